# All of it on a bare Debian: docker build --tag backstepping .
FROM debian:12-slim
RUN apt-get update && apt-get install --yes --no-install-recommends ca-certificates git make
COPY . /backstepping
WORKDIR /backstepping
RUN make all && make check
CMD ["bash"]
