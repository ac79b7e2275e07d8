# Snap6D with everything it needs at run time; compose.yaml uses the same image for the scheduler and the workers.
FROM python:3.11-slim-bookworm

RUN apt-get update \
    && apt-get install -y --no-install-recommends libegl1 libgl1 libgomp1 libusb-1.0-0 \
    && rm -rf /var/lib/apt/lists/*

# numba keeps compiled kernels in its cache folder, which must be the user's own
RUN useradd --uid 10001 --create-home snap6d \
    && install -d -o snap6d -g snap6d /var/lib/snap6d /var/cache/snap6d
ENV PYTHONUNBUFFERED=1 \
    NUMBA_CACHE_DIR=/var/cache/snap6d \
    SNAP6D_STATE_DIR=/var/lib/snap6d

WORKDIR /opt/snap6d

# the packages first, in a layer that a change of the code leaves as it is
COPY pyproject.toml constraints.txt ./
RUN python -c "import tomllib; project = tomllib.load(open('pyproject.toml', 'rb'))['project']; \
print(*project['dependencies'], *project['optional-dependencies']['app'], sep='\n')" > /tmp/requirements.txt \
    && pip install --no-cache-dir --constraint constraints.txt setuptools \
    && pip install --no-cache-dir --use-pep517 --no-build-isolation --constraint constraints.txt \
        --requirement /tmp/requirements.txt \
    && rm /tmp/requirements.txt

COPY setup.py README.md LICENSE ./
COPY registration_core registration_core
COPY app app
COPY migrations migrations
COPY static static
COPY scenes scenes
RUN pip install --no-cache-dir --no-deps --no-build-isolation --editable . \
    && python -m compileall -q app registration_core migrations

USER snap6d
# on a processor of another kind numba compiles them again at the first start
RUN python -c "from registration_core.compilation import warm_up; warm_up()"

VOLUME /var/lib/snap6d
EXPOSE 8000
HEALTHCHECK --interval=10s --timeout=5s --start-period=180s --retries=3 \
    CMD ["python", "-c", "import urllib.request; urllib.request.urlopen('http://127.0.0.1:8000/api/health', timeout=4)"]
CMD ["snap6d", "serve", "--prepare", "--host", "0.0.0.0", "--port", "8000"]
