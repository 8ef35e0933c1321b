# The screening service: one process, no privileges, nothing fetched at run time.
#
#   docker build --build-arg PIP_EXTRA_INDEX_URL=<index with CPU builds of torch> -t rubscreen .
#   docker run --rm -v rubscreen:/home/rubscreen/data rubscreen rubscreen keys create "design office" --role admin
#   docker run --rm -v rubscreen:/home/rubscreen/data -p 8000:8000 rubscreen
#
# The first of these prints a key; the second does not start while there is none, or with RUBSCREEN_AUTH=off
# lets in whoever reaches the port.
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

# The data folder belongs to the user, so that a volume mounted there for the first time does too.
RUN useradd --system --create-home --home-dir /home/rubscreen rubscreen \
    && install -d -o rubscreen /home/rubscreen/data
ENV RUBSCREEN_DATA_FOLDER=/home/rubscreen/data
USER rubscreen
WORKDIR /home/rubscreen

EXPOSE 8000
HEALTHCHECK --interval=15s --timeout=5s --start-period=60s CMD ["python", "-c", "from urllib.request import urlopen; urlopen('http://127.0.0.1:8000/readyz', timeout=4)"]
STOPSIGNAL SIGTERM
CMD ["rubscreen", "serve", "--host", "0.0.0.0", "--port", "8000"]
