#include <optional>

#include "rtstdb/gpu/instance.hpp"
#include "rtstdb/gpu/required_features.hpp"

namespace rtstdb::gpu {
namespace {

std::string version_text(std::uint32_t version) {
  return std::to_string(VK_API_VERSION_MAJOR(version)) + "." + std::to_string(VK_API_VERSION_MINOR(version)) +
         "." + std::to_string(VK_API_VERSION_PATCH(version));
}

DeviceKind kind_of(vk::PhysicalDeviceType type) {
  switch (type) {
    case vk::PhysicalDeviceType::eDiscreteGpu:
      return DeviceKind::discrete;
    case vk::PhysicalDeviceType::eIntegratedGpu:
      return DeviceKind::integrated;
    case vk::PhysicalDeviceType::eVirtualGpu:
      return DeviceKind::virtual_gpu;
    case vk::PhysicalDeviceType::eCpu:
      return DeviceKind::cpu;
    default:
      return DeviceKind::other;
  }
}

/// The first queue family with compute (which implies copies), timestamps and these further abilities.
std::optional<std::uint32_t> find_queue_family(const vk::raii::PhysicalDevice& device, vk::QueueFlags more) {
  const vk::QueueFlags wanted = vk::QueueFlagBits::eCompute | more;
  const auto families = device.getQueueFamilyProperties();
  for (std::uint32_t i = 0; i < families.size(); ++i) {
    if ((families[i].queueFlags & wanted) == wanted && families[i].timestampValidBits != 0) return i;
  }
  return std::nullopt;
}

/// The device must support Vulkan 1.3 or later.
std::string why_unsuitable(const vk::raii::PhysicalDevice& device, bool has_queue) {
  if (!has_queue) return "no compute queue with timestamps";
  if (const char* feature = missing_feature(device)) return std::string("it lacks ") + feature;
  return {};
}

PhysicalDevice describe(vk::raii::PhysicalDevice device) {
  const auto chain =
      device.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceDriverProperties>();
  const auto& properties = chain.get<vk::PhysicalDeviceProperties2>().properties;
  const auto& driver = chain.get<vk::PhysicalDeviceDriverProperties>();
  Candidate candidate;
  candidate.info.name = properties.deviceName.data();
  candidate.info.driver = std::string(driver.driverName.data()) + " " + driver.driverInfo.data();
  candidate.info.api = version_text(properties.apiVersion);
  candidate.info.software = properties.deviceType == vk::PhysicalDeviceType::eCpu;
  candidate.kind = kind_of(properties.deviceType);
  auto queue_family = find_queue_family(device, vk::QueueFlagBits::eGraphics);
  const bool draws = queue_family && has_raster_features(device);
  candidate.info.draws = draws;
  if (!queue_family) queue_family = find_queue_family(device, {});
  candidate.unsuitable = properties.apiVersion < VK_API_VERSION_1_3
                             ? "Vulkan " + candidate.info.api + ", not 1.3"
                             : why_unsuitable(device, queue_family.has_value());
  return {std::move(device), std::move(candidate), queue_family.value_or(0), draws};
}

}  // namespace

std::vector<PhysicalDevice> physical_devices(const Instance& instance) {
  std::vector<PhysicalDevice> devices;
  for (auto& device : vk::raii::PhysicalDevices(instance.instance))
    devices.push_back(describe(std::move(device)));
  return devices;
}

}  // namespace rtstdb::gpu
