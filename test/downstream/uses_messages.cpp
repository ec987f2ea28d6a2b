#include <jackal_aic/ControllerState.h>
#include <ros/time.h>

int main() {
  ros::Time::init();
  jackal_aic::ControllerState state;
  state.header.stamp = ros::Time::now();
  return state.header.stamp.isZero() ? 1 : 0;
}
