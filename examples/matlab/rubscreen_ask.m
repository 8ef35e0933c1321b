function answer = rubscreen_ask(url, path, question, key)
% Ask a running rubscreen service: answer = rubscreen_ask('http://127.0.0.1:8000', '/v1/stability', question)
%
% question   JSON text (see rubscreen_points.m), sent as it is; '' only looks (GET), as in rubscreen_batch.m
% key        API key, for a service that asks for one; left out, that of RUBSCREEN_API_KEY
% answer     struct; null is empty or NaN, as jsondecode has it
%
% A refusal is an error with the service's field, value and remedy.
% MATLAB R2016b or later: matlab.net.http. In GNU Octave, which lacks it, curl sends the question instead.
% Only the Octave branch was run (Octave 7.3); the MATLAB branch follows MathWorks' documentation and was not.
  if nargin < 4, key = getenv('RUBSCREEN_API_KEY'); end
  if exist('OCTAVE_VERSION', 'builtin')
    [status, text] = by_curl([url path], question, key);
  else
    [status, text] = by_matlab([url path], question, key);
  end
  answer = jsondecode(text);
  if status >= 400
    error('rubscreen:refused', '%s', answer.detail);
  end
end

function [status, text] = by_matlab(address, question, key)
  header = [matlab.net.http.HeaderField('Content-Type', 'application/json'), ...
            matlab.net.http.HeaderField('Accept', 'application/json')];
  if ~isempty(key)
    header(end+1) = matlab.net.http.HeaderField('Authorization', ['Bearer ' strtrim(key)]);
  end
  if isempty(question)
    request = matlab.net.http.RequestMessage('GET', header(2:end));
  else
    header(end+1) = matlab.net.http.HeaderField('Idempotency-Key', order_key());
    body = matlab.net.http.MessageBody();
    body.Payload = unicode2native(question, 'UTF-8');
    request = matlab.net.http.RequestMessage('POST', header, body);
  end
  % Not converted, so that answers and problem documents are decoded alike.
  options = matlab.net.http.HTTPOptions('ConvertResponse', false, 'ResponseTimeout', 300);
  response = request.send(address, options);
  status = double(response.StatusCode);
  text = char(response.Body.Data);
end

function [status, text] = by_curl(address, question, key)
  asked = [tempname() '.json'];
  file = fopen(asked, 'w'); fwrite(file, question); fclose(file);
  headers = [tempname() '.txt'];  % a key among the arguments could be seen by others on the machine
  file = fopen(headers, 'w'); fprintf(file, 'Accept: application/json\n');
  if ~isempty(question), fprintf(file, 'Content-Type: application/json\nIdempotency-Key: %s\n', order_key()); end
  if ~isempty(key), fprintf(file, 'Authorization: Bearer %s\n', strtrim(key)); end
  fclose(file);
  clean = onCleanup(@() cellfun(@delete, {asked, headers}));
  body = '';
  if ~isempty(question), body = sprintf('--data-binary "@%s"', asked); end
  command = sprintf('curl --silent --show-error --retry 5 --max-time 300 --header "@%s" %s --write-out "\\n%%{http_code}" "%s"', ...
                    headers, body, address);
  [failed, said] = system(command);
  if failed, error('rubscreen:unreachable', 'no answer from %s', address); end
  lines = strsplit(said, "\n");
  status = str2double(lines{end});
  text = strjoin(lines(1:end-1), "\n");
end

function key = order_key()
% What makes a job that is sent twice, because its answer was lost, one job; other calls do without.
  [~, unique] = fileparts(tempname());
  key = sprintf('%s-%.0f', unique, now() * 86400e3);
end
