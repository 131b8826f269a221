# er-gym in a container: no GPU, X server, Vulkan or Unity, and a user without rights.
#
#   docker build --tag ergym .
#   docker run --rm ergym                                  # what works here
#   docker run --rm --volume "$PWD/runs:/home/er/runs" ergym bench --suite mini --agent oracle --out runs/x
#
# More extras: docker build --build-arg EXTRAS=vlm,ui .
FROM python:3.11-slim
# The C compiler makes the quick kernels at first use; without it, all works more slowly.
RUN apt-get update \
    && apt-get install --yes --no-install-recommends gcc libc6-dev \
    && rm -rf /var/lib/apt/lists/* \
    && useradd --create-home er
ARG EXTRAS=vlm
COPY . /opt/er-gym
RUN pip install --no-cache-dir --constraint /opt/er-gym/constraints.txt "/opt/er-gym[${EXTRAS}]"
USER er
WORKDIR /home/er
ENTRYPOINT ["er-gym"]
CMD ["doctor"]
