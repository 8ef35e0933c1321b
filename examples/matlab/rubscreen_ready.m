% Is a rubscreen service there and ready? In MATLAB and in GNU Octave 7 or later (run with Octave 7.3).
url = getenv('RUBSCREEN_URL');
if isempty(url), url = 'http://127.0.0.1:8000'; end
answer = webread([url '/readyz']);
if ischar(answer), answer = jsondecode(answer); end  % MATLAB decodes JSON by itself, Octave does not
fprintf('%s, model %s\n', answer.status, answer.model);
