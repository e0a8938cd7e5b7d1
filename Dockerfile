# wgmb with lavapipe, for farms and for a try: works on the files of /work.
#   docker build --tag wgmb .
#   docker run --rm --volume "$PWD:/work" wgmb blur 'shot.####.exr' -o 'blurred.####.exr'
FROM python:3.13-slim-trixie AS built
RUN pip install --no-cache-dir build
COPY . /wgmb
RUN python -m build --wheel --outdir /dist /wgmb

FROM python:3.13-slim-trixie
RUN apt-get update && apt-get install -y --no-install-recommends libvulkan1 mesa-vulkan-drivers \
    && rm -rf /var/lib/apt/lists/*
COPY constraints.txt /
COPY --from=built /dist /dist
RUN pip install --no-cache-dir --constraint /constraints.txt \
        "$(echo /dist/*.whl)[cli,images,video,flow,ocio,edit,cluster]" \
    && rm -r /dist /constraints.txt && useradd --create-home artist
USER artist
WORKDIR /work
ENTRYPOINT ["wgmb"]
CMD ["--help"]
