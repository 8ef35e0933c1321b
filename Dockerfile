# The screening service: no privileges, nothing fetched at run time, what it keeps is in a volume.
#
#   docker build --build-arg PIP_EXTRA_INDEX_URL=<index with CPU builds of torch> -t rubscreen .
#   docker run --rm -v rubscreen:/home/rubscreen/data rubscreen rubscreen keys create "design office" --role submit
#   docker run -d -p 127.0.0.1:8000:8000 -v rubscreen:/home/rubscreen/data --stop-timeout 60 rubscreen
#
# The key comes first: a service that others can reach does not start without one. The index matters since
# the default one's torch for x86 holds gigabytes of CUDA libraries the service never uses. Settings are
# RUBSCREEN_... environment variables. compose.yaml has replicas, PostgreSQL and workers as well.
# This Debian's PostgreSQL client is of version 15, as the server of compose.yaml: for `rubscreen backup`.
FROM python:3.11-slim-bookworm

ARG PIP_EXTRA_INDEX_URL

RUN apt-get update && apt-get install --yes --no-install-recommends postgresql-client \
    && rm -rf /var/lib/apt/lists/*

WORKDIR /opt/rubscreen

COPY pyproject.toml README.md ./
COPY sdm_core sdm_core
COPY training training
COPY service service
RUN pip install --no-cache-dir .

# The data folder belongs to the user, so that a volume mounted there for the first time does too.
RUN useradd --system --create-home --home-dir /home/rubscreen rubscreen \
    && install -d -o rubscreen /home/rubscreen/data
ENV RUBSCREEN_DATA_FOLDER=/home/rubscreen/data
VOLUME /home/rubscreen/data
USER rubscreen
WORKDIR /home/rubscreen

EXPOSE 8000
HEALTHCHECK --interval=15s --timeout=5s --start-period=60s CMD ["python", "-c", "from urllib.request import urlopen; urlopen('http://127.0.0.1:8000/readyz', timeout=4)"]
STOPSIGNAL SIGTERM
CMD ["rubscreen", "serve", "--host", "0.0.0.0", "--port", "8000"]
