#include "drivers/axis_group.h"

namespace hilbrush {

const char* device_state_name(DeviceState state) {
  switch (state) {
    case DeviceState::kDisconnected:
      return "disconnected";
    case DeviceState::kConnected:
      return "connected";
    case DeviceState::kEnabled:
      return "enabled";
    case DeviceState::kReady:
      return "ready";
    case DeviceState::kMoving:
      return "moving";
    case DeviceState::kFault:
      return "fault";
  }
  return "unknown";
}

}  // namespace hilbrush
