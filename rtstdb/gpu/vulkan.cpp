#include "rtstdb/gpu/vulkan.hpp"

#include <string>

namespace rtstdb::gpu {

Error to_error(const vk::SystemError& failure, std::string_view what) {
  const auto result = static_cast<vk::Result>(failure.code().value());
  const std::string sentence = std::string(what) + ": " + vk::to_string(result);
  switch (result) {
    case vk::Result::eErrorOutOfHostMemory:
    case vk::Result::eErrorOutOfDeviceMemory:
    case vk::Result::eErrorOutOfPoolMemory:
    case vk::Result::eErrorFragmentation:
      return {ErrorCode::out_of_memory, sentence};
    case vk::Result::eErrorTooManyObjects:
      return {ErrorCode::capacity, sentence};
    case vk::Result::eErrorDeviceLost:
      return {ErrorCode::device_lost, sentence};
    default:
      return {ErrorCode::no_device, sentence};
  }
}

}  // namespace rtstdb::gpu
