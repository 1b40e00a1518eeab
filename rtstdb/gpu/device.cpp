#include "rtstdb/gpu/device.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <new>
#include <string>
#include <thread>
#include <tuple>
#include <utility>

#include "rtstdb/gpu/device_impl.hpp"
#include "rtstdb/gpu/required_features.hpp"

namespace rtstdb::gpu {
namespace {

/// Whether the device can import host memory at the alignment of HostMemory.
bool can_import_host_memory(const vk::raii::PhysicalDevice& device) {
  const auto extensions = device.enumerateDeviceExtensionProperties();
  const bool there = std::ranges::any_of(extensions, [](const vk::ExtensionProperties& extension) {
    return std::strcmp(extension.extensionName, VK_EXT_EXTERNAL_MEMORY_HOST_EXTENSION_NAME) == 0;
  });
  if (!there) return false;
  const auto properties =
      device
          .getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceExternalMemoryHostPropertiesEXT>();
  return properties.get<vk::PhysicalDeviceExternalMemoryHostPropertiesEXT>()
             .minImportedHostPointerAlignment <= HostMemory::page_bytes;
}

/// A driver that gets no memory may throw. The lock of the Vulkan loader, which the exception passes, is then
/// never released, and destroying the instance would wait for it: the instance is left alone.
vk::raii::Device create_device(const PhysicalDevice& chosen, bool imports_host_memory,
                               std::unique_ptr<Instance>& instance) {
  const float priority = 1.0f;
  const vk::DeviceQueueCreateInfo queue({}, chosen.queue_family, 1, &priority);
  FeatureChain features = required_features(chosen.draws);
  const char* const extension = VK_EXT_EXTERNAL_MEMORY_HOST_EXTENSION_NAME;
  vk::DeviceCreateInfo options({}, 1, &queue, 0, nullptr, imports_host_memory ? 1u : 0u, &extension);
  options.pNext = &features.get<vk::PhysicalDeviceFeatures2>();
  const VkDeviceCreateInfo& plain_options = options;
  VkDevice device = VK_NULL_HANDLE;
  VkResult result = VK_SUCCESS;
  try {
    result = chosen.handle.getDispatcher()->vkCreateDevice(*chosen.handle, &plain_options, nullptr, &device);
  } catch (const std::bad_alloc&) {
    static_cast<void>(instance.release());
    throw;
  }
  if (result != VK_SUCCESS) vk::throwResultException(static_cast<vk::Result>(result), "vkCreateDevice");
  return {chosen.handle, device};
}

std::vector<MemoryTraits> describe_memory(const vk::raii::PhysicalDevice& device) {
  using Flag = vk::MemoryPropertyFlagBits;
  constexpr auto plain = Flag::eDeviceLocal | Flag::eHostVisible | Flag::eHostCoherent | Flag::eHostCached;
  const auto properties = device.getMemoryProperties();
  std::vector<MemoryTraits> types;
  for (std::uint32_t i = 0; i < properties.memoryTypeCount; ++i) {
    const auto flags = properties.memoryTypes[i].propertyFlags;
    types.push_back({.device_local = bool(flags & Flag::eDeviceLocal),
                     .host_visible = bool(flags & Flag::eHostVisible),
                     .host_coherent = bool(flags & Flag::eHostCoherent),
                     .host_cached = bool(flags & Flag::eHostCached),
                     .special = bool(flags & ~plain)});
  }
  return types;
}

/// The number of processors that llvmpipe's threads can use at a time.
std::uint32_t software_processors() {
  const long all = std::max(std::thread::hardware_concurrency(), 1u);
  const char* const threads = std::getenv("LP_NUM_THREADS");
  return static_cast<std::uint32_t>(
      threads == nullptr ? all : std::clamp(std::strtol(threads, nullptr, 10), 1l, all));
}

}  // namespace

Device::Impl::Impl(std::unique_ptr<Instance> instance_in, const PhysicalDevice& chosen,
                   const DeviceOptions& options)
    : instance(std::move(instance_in)),
      physical_device(chosen.handle),
      info(chosen.candidate.info),
      queue_family(chosen.queue_family),
      imports_host_memory(options.imports_host_memory && can_import_host_memory(chosen.handle)),
      device(create_device(chosen, imports_host_memory, instance)),
      queue(device, queue_family, 0),
      pipeline_cache(device, vk::PipelineCacheCreateInfo({}, options.pipeline_cache.size(),
                                                         options.pipeline_cache.data())) {
  const auto chain =
      physical_device
          .getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceMaintenance3Properties,
                          vk::PhysicalDeviceMaintenance4Properties, vk::PhysicalDeviceSubgroupProperties>();
  const auto& core = chain.get<vk::PhysicalDeviceProperties2>().properties.limits;
  limits.max_storage_range_bytes = core.maxStorageBufferRange;
  limits.storage_alignment_bytes = core.minStorageBufferOffsetAlignment;
  limits.max_texel_elements = core.maxTexelBufferElements;
  limits.max_groups = core.maxComputeWorkGroupCount[0];
  limits.max_raster_side =
      chosen.draws && options.draws ? std::min(core.maxFramebufferWidth, core.maxFramebufferHeight) : 0;
  info.draws = limits.max_raster_side > 0;
  if (info.software) limits.processors = options.processors > 0 ? options.processors : software_processors();
  const std::size_t max_buffer_bytes = chain.get<vk::PhysicalDeviceMaintenance4Properties>().maxBufferSize;
  limits.max_allocation_bytes = std::min<std::size_t>(
      chain.get<vk::PhysicalDeviceMaintenance3Properties>().maxMemoryAllocationSize, max_buffer_bytes);
  const auto& subgroups = chain.get<vk::PhysicalDeviceSubgroupProperties>();
  if (options.use_subgroup_kernels) limits.subgroup_size = subgroups.subgroupSize;
  max_group_size = std::min(core.maxComputeWorkGroupSize[0], core.maxComputeWorkGroupInvocations);
  max_allocations = core.maxMemoryAllocationCount;
  timestamp_period_ns = static_cast<double>(core.timestampPeriod);
  timestamp_bits = physical_device.getQueueFamilyProperties()[queue_family].timestampValidBits;
  memory_types = describe_memory(physical_device);
}

void Device::Impl::name(vk::ObjectType type, std::uint64_t handle, const std::string& text) const {
  if (instance->has_debug_names) device.setDebugUtilsObjectNameEXT({type, handle, text.c_str()});
}

vk::raii::DeviceMemory Device::Impl::allocate(const vk::MemoryRequirements& needs, Memory purpose,
                                              const void* next) const {
  for (const std::uint32_t type : rank_memory_types(memory_types, needs.memoryTypeBits, purpose)) {
    try {
      return {device, vk::MemoryAllocateInfo(needs.size, type, next)};
    } catch (
        const vk::OutOfDeviceMemoryError&) {  // NOLINT(bugprone-empty-catch): the next type may have room
    }
  }
  throw vk::OutOfDeviceMemoryError("every suitable memory type is full");
}

Device::Device(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}
Device::~Device() = default;

Result<std::unique_ptr<Device>> Device::open(const DeviceOptions& options) {
  if (!options.shared) {
    auto impl = open_impl(options);
    if (!impl) return impl.error();
    return std::unique_ptr<Device>(new Device(std::move(impl).value()));
  }
  using Key = std::tuple<std::string, bool, std::string, bool, bool, bool, std::uint32_t>;
  static std::mutex mutex;
  static auto& open_ones =
      *new std::map<Key, std::shared_ptr<Impl>>;  // not destroyed: the driver still runs then
  const std::lock_guard lock(mutex);
  auto& impl =
      open_ones[{options.select, options.validation, options.loader_library, options.imports_host_memory,
                 options.draws, options.use_subgroup_kernels, options.processors}];
  if (!impl || impl->lost) {
    auto opened = open_impl(options);
    if (!opened) return opened.error();
    impl = std::move(opened).value();
  }
  return std::unique_ptr<Device>(new Device(impl));
}

Result<std::shared_ptr<Device::Impl>> Device::open_impl(const DeviceOptions& options) {
  auto instance = Instance::open(options.loader_library, options.validation);
  if (!instance) return instance.error();
  try {
    auto devices = physical_devices(*instance.value());
    std::vector<Candidate> candidates;
    candidates.reserve(devices.size());
    for (const PhysicalDevice& device : devices)
      candidates.push_back(device.candidate);
    const auto chosen = choose_device(options.select, candidates);
    if (!chosen) return chosen.error();
    return std::make_shared<Impl>(std::move(instance).value(), std::move(devices[chosen.value()]), options);
  } catch (const vk::SystemError& failure) {
    return to_error(failure, "the Vulkan device can not be opened");
  }
}

std::vector<DeviceInfo> Device::list() {
  std::vector<DeviceInfo> infos;
  const auto instance = Instance::open(DeviceOptions{}.loader_library, false);
  if (!instance) return infos;
  try {
    for (PhysicalDevice& device : physical_devices(*instance.value())) {
      infos.push_back(std::move(device.candidate.info));
    }
  } catch (const vk::SystemError&) {
    infos.clear();  // a driver that fails to enumerate offers no device
  }
  return infos;
}

const DeviceInfo& Device::info() const noexcept {
  return impl_->info;
}
const DeviceLimits& Device::limits() const noexcept {
  return impl_->limits;
}
void Device::compile_on_first_dispatch(bool late) noexcept {
  impl_->compile_on_first_dispatch = late;
}
bool Device::compiles_on_first_dispatch() const noexcept {
  return impl_->compile_on_first_dispatch;
}
std::vector<std::byte> Device::pipeline_cache_data() const {
  const VkDevice device = *impl_->device;
  const VkPipelineCache cache = *impl_->pipeline_cache;
  std::size_t size = 0;
  if (impl_->vk().vkGetPipelineCacheData(device, cache, &size, nullptr) != VK_SUCCESS) return {};
  std::vector<std::byte> data(size);
  if (impl_->vk().vkGetPipelineCacheData(device, cache, &size, data.data()) != VK_SUCCESS) return {};
  data.resize(size);
  return data;
}
bool Device::lost() const noexcept {
  return impl_->lost;
}
std::vector<std::string> Device::validation_messages() const {
  return impl_->instance->validation_log.messages();
}

}  // namespace rtstdb::gpu
