#pragma once
// The Vulkan instance with its validation log, and the physical devices as candidates.

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <rtstdb/result.hpp>

#include "rtstdb/gpu/device_choice.hpp"
#include "rtstdb/gpu/vulkan.hpp"

namespace rtstdb::gpu {

/// The errors and warnings of the validation layer, each text once. Thread-safe, since the layer reports from
/// any thread that calls Vulkan.
class ValidationLog {
 public:
  void add(std::string_view message);
  std::vector<std::string> messages() const;

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> messages_;
};

struct Instance {
  vk::raii::Context context;
  vk::raii::Instance instance;
  bool has_debug_names;  ///< VK_EXT_debug_utils is on
  ValidationLog validation_log;
  vk::raii::DebugUtilsMessengerEXT messenger;  ///< null without validation

  Instance(vk::raii::Context context_in, vk::raii::Instance instance_in, bool has_debug_names_in);

  /// Errors: no_device, when the loader, every driver, or the requested validation layer is missing, or the
  /// loader is older than Vulkan 1.3.
  static Result<std::unique_ptr<Instance>> open(const std::string& loader_library, bool validation);
};

struct PhysicalDevice {
  vk::raii::PhysicalDevice handle;
  Candidate candidate;
  std::uint32_t queue_family;  ///< supports compute and timestamps; meaningless for an unsuitable candidate
  bool draws = false;          ///< its queue supports graphics, and it has what the rasteriser needs
};

/// In the order of the loader, which is that of the devices' indices.
std::vector<PhysicalDevice> physical_devices(const Instance& instance);

}  // namespace rtstdb::gpu
