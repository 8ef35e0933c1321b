% Is NASA rotor 37 stable at these points, and from which K_e on is it unstable?
% Run in examples/matlab, with `rubscreen serve` running: rubscreen_points
% RUBSCREEN_URL is another address than http://127.0.0.1:8000, RUBSCREEN_API_KEY the key where one is needed.
% Run with GNU Octave 7.3 in this form; MATLAB was not at hand.
url = getenv('RUBSCREEN_URL');
if isempty(url), url = 'http://127.0.0.1:8000'; end

% The blade file goes into the question as it is: decoded and encoded again, lists of one entry become numbers.
blade = fileread(fullfile('..', '..', 'sdm_core', 'blade', 'examples', 'nasa_rotor_37.json'));
row = @(values) ['[' strjoin(arrayfun(@(x) sprintf('%.17g', x), values, 'UniformOutput', false), ',') ']'];
contact = '"contact": {"weights": {"LE": 1.0}}';

ke = [5000 9500 20000];
question = ['{"blade": ' blade ', ' contact ', "speed_hz": ' row(241 * ones(size(ke))) ', "ke": ' row(ke) '}'];
answer = rubscreen_ask(url, '/v1/stability', question);
for i = 1:numel(ke)
  if iscell(answer.stable), stable = answer.stable{i}; else, stable = answer.stable(i); end
  if isempty(stable), word = 'not decided'; elseif stable, word = 'stable'; else, word = 'unstable'; end
  fprintf('K_e %6.0f N/m: %s (%s)\n', ke(i), word, answer.source{i});
end

question = ['{"blade": ' blade ', ' contact ', "speed_hz": [200, 241], "ke_max": 25000, "policy": "exact"}'];
answer = rubscreen_ask(url, '/v1/boundary', question);
fprintf('unstable from %.1f and %.1f N/m on\n', answer.critical_ke);

try
  rubscreen_ask(url, '/v1/stability', ['{"blade": ' blade ', ' contact ', "speed_hz": [-1], "ke": [1]}']);
catch refused
  fprintf('refused: %s\n', refused.message);
end
