#include "rtstdb/gpu/instance.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "rtstdb/gpu/loader.hpp"

namespace rtstdb::gpu {
namespace {

constexpr const char* validation_layer = "VK_LAYER_KHRONOS_validation";

VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT /*severity*/,
                                          VkDebugUtilsMessageTypeFlagsEXT /*types*/,
                                          const VkDebugUtilsMessengerCallbackDataEXT* data, void* log) {
  static_cast<ValidationLog*>(log)->add(data->pMessage);
  return VK_FALSE;  // false: the layer does not abort the call
}

bool has_layer(const vk::raii::Context& context, const char* name) {
  const auto layers = context.enumerateInstanceLayerProperties();
  return std::any_of(layers.begin(), layers.end(),
                     [name](const vk::LayerProperties& l) { return std::strcmp(l.layerName, name) == 0; });
}

bool has_debug_utils(const vk::raii::Context& context, const char* layer) {
  const auto named = [](const vk::ExtensionProperties& e) {
    return std::strcmp(e.extensionName, VK_EXT_DEBUG_UTILS_EXTENSION_NAME) == 0;
  };
  auto extensions = context.enumerateInstanceExtensionProperties();
  if (std::any_of(extensions.begin(), extensions.end(), named)) return true;
  if (layer == nullptr) return false;
  extensions = context.enumerateInstanceExtensionProperties(std::string(layer));
  return std::any_of(extensions.begin(), extensions.end(), named);
}

Result<std::unique_ptr<Instance>> create(vk::raii::Context context, bool validation) {
  if (context.enumerateInstanceVersion() < VK_API_VERSION_1_3) {
    return Error{ErrorCode::no_device,
                 "no Vulkan device: the Vulkan loader is older than 1.3; install a newer libvulkan1"};
  }
  if (validation && !has_layer(context, validation_layer)) {
    return Error{ErrorCode::no_device,
                 std::string("Vulkan validation was requested, but the layer ") + validation_layer +
                     " is not installed; install vulkan-validationlayers or turn validation off"};
  }
  const char* layer = validation ? validation_layer : nullptr;
  const bool debug_utils = has_debug_utils(context, layer);
  if (validation && !debug_utils) {
    return Error{
        ErrorCode::no_device,
        "Vulkan validation was requested, but its messages can not be read: VK_EXT_debug_utils is missing"};
  }
  const char* extension = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
  const vk::ApplicationInfo application("rtstdb", 1, "rtstdb", 1, VK_API_VERSION_1_3);
  const vk::InstanceCreateInfo options({}, &application, validation ? 1u : 0u, &layer, debug_utils ? 1u : 0u,
                                       &extension);
  vk::raii::Instance handle(context, options);
  auto instance = std::make_unique<Instance>(std::move(context), std::move(handle), debug_utils);
  if (validation) {
    using Severity = vk::DebugUtilsMessageSeverityFlagBitsEXT;
    const vk::DebugUtilsMessengerCreateInfoEXT messenger({}, Severity::eWarning | Severity::eError,
                                                         vk::DebugUtilsMessageTypeFlagBitsEXT::eValidation,
                                                         &on_message, &instance->validation_log);
    instance->messenger = vk::raii::DebugUtilsMessengerEXT(instance->instance, messenger);
  }
  return instance;
}

}  // namespace

void ValidationLog::add(std::string_view message) {
  const std::lock_guard lock(mutex_);
  if (std::find(messages_.begin(), messages_.end(), message) == messages_.end())
    messages_.emplace_back(message);
}

std::vector<std::string> ValidationLog::messages() const {
  const std::lock_guard lock(mutex_);
  return messages_;
}

Instance::Instance(vk::raii::Context context_in, vk::raii::Instance instance_in, bool has_debug_names_in)
    : context(std::move(context_in)),
      instance(std::move(instance_in)),
      has_debug_names(has_debug_names_in),
      messenger(nullptr) {}

Result<std::unique_ptr<Instance>> Instance::open(const std::string& loader_library, bool validation) {
  auto entry = load_vulkan(loader_library);
  if (!entry) return entry.error();
  try {
    return create(
        vk::raii::Context(reinterpret_cast<PFN_vkGetInstanceProcAddr>(entry.value().get_instance_proc_addr)),
        validation);
  } catch (const vk::IncompatibleDriverError&) {
    // The loader reports missing drivers this way.
    return choose_device("auto", {}).error();
  } catch (const vk::SystemError& failure) {
    return to_error(failure, "no Vulkan device: creating the Vulkan instance failed");
  }
}

}  // namespace rtstdb::gpu
