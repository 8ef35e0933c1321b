% A batch of blades as a durable job of a running service, ranked. Run in examples/matlab: rubscreen_batch
% RUBSCREEN_URL is another address than http://127.0.0.1:8000, RUBSCREEN_API_KEY the key where one is needed.
% Run with GNU Octave 7.3 in this form; MATLAB was not at hand.
url = getenv('RUBSCREEN_URL');
if isempty(url), url = 'http://127.0.0.1:8000'; end

% Blade files go into the question as they are: decoded and encoded again, lists of one entry become numbers.
blade = fileread(fullfile('..', '..', 'sdm_core', 'blade', 'examples', 'nasa_rotor_37.json'));
question = ['{"name": "from MATLAB", "blades": [' blade ', {"example": "generic_compressor_blade"}], ' ...
            '"contacts": [{"name": "LE", "weights": {"LE": 1}}, {"name": "both", "weights": {"LE": 1, "TE": 1}}], ' ...
            '"ke_liner": 9000, "criteria": {"least_margin": 0.2}, "map_shape": [32, 32]}'];
job = rubscreen_ask(url, '/v1/screenings', question);
place = ['/v1/screenings/' job.id];

% The job goes on whatever becomes of this session: `place` finds it again.
while ~any(strcmp(job.state, {'done', 'failed', 'cancelled'}))
  pause(1);
  job = rubscreen_ask(url, place, '');
  fprintf('%s %s: %d of %d\n', job.state, job.progress.stage, job.progress.done, job.progress.total);
end
if strcmp(job.state, 'failed')
  error('rubscreen:failed', '%s = %s: %s', job.error.field, job.error.value, job.error.remedy);
end

found = rubscreen_ask(url, [place '/results?limit=1000'], '');
for i = 1:numel(found.results)
  if iscell(found.results), row = found.results{i}; else, row = found.results(i); end
  if isempty(row.smallest_unstable_ke) || isnan(row.smallest_unstable_ke), ke = 'none'; else, ke = sprintf('%.0f', row.smallest_unstable_ke); end
  if row.meets_criteria, word = 'meets the criteria'; else, word = 'misses them'; end
  fprintf('%d. %s, %s: %s N/m, %s\n', row.rank, row.blade, row.contact_name, ke, word);
end
