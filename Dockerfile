# syntax=docker/dockerfile:1
# One image for the API, the worker and the all-in-one service; the command chooses.

FROM python:3.11.14-slim-bookworm AS build
WORKDIR /src
RUN python -m venv /opt/meshcone
COPY pyproject.toml constraints.txt README.md LICENSE ./
COPY meshcone ./meshcone
COPY worker ./worker
COPY service ./service
# The documentation, which the pages serve under /help.
COPY zensical.toml ./
COPY docs ./docs
RUN python -m venv /opt/site \
    && /opt/site/bin/pip install --no-cache-dir --disable-pip-version-check zensical==0.0.73 \
    && /opt/site/bin/zensical build --clean --strict
# Readers of design files, such as "[3mf,cad,usd]": 320 MB for these three.
ARG EXTRAS=""
RUN /opt/meshcone/bin/pip install --no-cache-dir --disable-pip-version-check \
        --constraint constraints.txt ".${EXTRAS}"
# What is in there, as CycloneDX: a bill of materials for whoever has to answer for the image.
RUN python -m venv /opt/bill \
    && /opt/bill/bin/pip install --no-cache-dir --disable-pip-version-check \
        --constraint constraints.txt cyclonedx-bom==7.5.0 \
    && /opt/bill/bin/cyclonedx-py environment --output-reproducible --pyproject pyproject.toml \
        -o /opt/meshcone/meshcone.cdx.json /opt/meshcone/bin/python

FROM python:3.11.14-slim-bookworm
ENV PATH=/opt/meshcone/bin:$PATH \
    PYTHONDONTWRITEBYTECODE=1 \
    PYTHONUNBUFFERED=1 \
    PYTHONSAFEPATH=1 \
    MESHCONE_DATA_DIR=/data
# /data exists and belongs to the user, so that a new volume mounted there does too.
RUN groupadd --system --gid 10001 meshcone \
    && useradd --system --uid 10001 --gid meshcone --no-create-home meshcone \
    && install --directory --owner=meshcone --group=meshcone /data
COPY --from=build /opt/meshcone /opt/meshcone
USER 10001:10001
VOLUME /data
EXPOSE 8000
# Of `serve` and `api`; a worker listens on nothing and has a check of its own in docker-compose.yml.
HEALTHCHECK --interval=10s --timeout=5s --start-period=30s --retries=3 \
    CMD ["python", "-c", "import urllib.request; urllib.request.urlopen('http://127.0.0.1:8000/livez', timeout=4)"]
ENTRYPOINT ["meshcone"]
CMD ["serve", "--host", "0.0.0.0"]
