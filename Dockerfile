# The screening service: one process, no privileges, nothing fetched at run time.
#
#   docker build --build-arg PIP_EXTRA_INDEX_URL=<index with CPU builds of torch> -t rubscreen .
#   docker run --rm -p 8000:8000 rubscreen
#
# Without that index the build takes the torch of the default one, which for x86 holds several gigabytes
# of CUDA libraries the service never uses. Settings are RUBSCREEN_... environment variables.
FROM python:3.11-slim

ARG PIP_EXTRA_INDEX_URL

WORKDIR /opt/rubscreen

COPY pyproject.toml README.md ./
COPY sdm_core sdm_core
COPY training training
COPY service service
RUN pip install --no-cache-dir .

RUN useradd --system --create-home --home-dir /home/rubscreen rubscreen
USER rubscreen
WORKDIR /home/rubscreen

EXPOSE 8000
HEALTHCHECK --interval=15s --timeout=5s --start-period=60s CMD ["python", "-c", "from urllib.request import urlopen; urlopen('http://127.0.0.1:8000/readyz', timeout=4)"]
STOPSIGNAL SIGTERM
CMD ["rubscreen", "serve", "--host", "0.0.0.0", "--port", "8000"]
