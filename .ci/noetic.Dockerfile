# The package on Ubuntu 20.04 with ROS Noetic, what a Jackal runs, built and tested. Written by the documented interfaces of the image;
# not run by this project's own tests. From the checkout:
#   docker build -f .ci/noetic.Dockerfile -t jackal_aic .
#   docker run --rm -it jackal_aic
FROM ros:noetic-ros-base-focal
COPY . /jackal_aic
WORKDIR /jackal_aic
RUN ./scripts/build
CMD ["./scripts/test"]
