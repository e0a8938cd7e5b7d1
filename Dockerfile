# wgmb with lavapipe, for farms and for a try: works on the files of /work.
#   docker build --tag wgmb .
#   docker run --rm --volume "$PWD:/work" wgmb blur 'shot.####.exr' -o 'blurred.####.exr'
FROM python:3.13-slim-trixie@sha256:9662417aace5ae7b8e2609cce472b72a8958e134ba372808abe9cc1a0c0125e6 AS built
COPY . /wgmb
WORKDIR /wgmb
RUN mkdir /dist \
    && python tools/locked.py bundle >/needed.txt \
    && python tools/locked.py core cli images video flow ocio edit cluster >/dist/needed.txt \
    && pip install --no-cache-dir --require-hashes --no-deps --only-binary :all: \
        --requirement /needed.txt \
    && python -m hatchling build -t wheel -d /dist

FROM python:3.13-slim-trixie@sha256:9662417aace5ae7b8e2609cce472b72a8958e134ba372808abe9cc1a0c0125e6
RUN apt-get update && apt-get install -y --no-install-recommends libvulkan1 mesa-vulkan-drivers \
    && rm -rf /var/lib/apt/lists/*
COPY --from=built /dist /dist
RUN pip install --no-cache-dir --require-hashes --no-deps --only-binary :all: \
        --requirement /dist/needed.txt \
    && pip install --no-cache-dir --no-index --no-deps /dist/*.whl \
    && rm -r /dist && useradd --create-home artist
USER artist
WORKDIR /work
ENTRYPOINT ["wgmb"]
CMD ["--help"]
