#include "rtstdb/gpu/required_features.hpp"

namespace rtstdb::gpu {
namespace {

/// Calls `visit(feature, name)` for each required feature of the chain.
template <class Visit>
void for_each_required(FeatureChain& chain, Visit visit) {
  auto& core = chain.get<vk::PhysicalDeviceFeatures2>().features;
  auto& v12 = chain.get<vk::PhysicalDeviceVulkan12Features>();
  auto& v13 = chain.get<vk::PhysicalDeviceVulkan13Features>();
  visit(core.shaderInt64, "shaderInt64");
  visit(core.shaderFloat64, "shaderFloat64");  // exact conversion of nanoseconds to seconds
  visit(v12.timelineSemaphore, "timelineSemaphore");
  visit(v12.shaderSubgroupExtendedTypes, "shaderSubgroupExtendedTypes");
  visit(v12.scalarBlockLayout, "scalarBlockLayout");
  visit(v12.hostQueryReset, "hostQueryReset");
  visit(v12.bufferDeviceAddress,
        "bufferDeviceAddress");  // results above the size of a binding; stores of two words
  visit(v13.synchronization2, "synchronization2");
  visit(v13.maintenance4, "maintenance4");  // group size as a specialization constant; maxBufferSize
}

template <class Visit>
void for_each_of_raster(FeatureChain& chain, Visit visit) {
  auto& core = chain.get<vk::PhysicalDeviceFeatures2>().features;
  visit(core.multiDrawIndirect);
  visit(core.drawIndirectFirstInstance);
  visit(core.depthClamp);
  visit(chain.get<vk::PhysicalDeviceVulkan13Features>().dynamicRendering);
}

constexpr auto required_subgroup_operations =
    vk::SubgroupFeatureFlagBits::eBasic | vk::SubgroupFeatureFlagBits::eVote |
    vk::SubgroupFeatureFlagBits::eArithmetic | vk::SubgroupFeatureFlagBits::eBallot |
    vk::SubgroupFeatureFlagBits::eShuffle;

}  // namespace

FeatureChain required_features(bool draws) {
  FeatureChain chain;
  for_each_required(chain, [](vk::Bool32& feature, const char*) { feature = VK_TRUE; });
  if (draws) for_each_of_raster(chain, [](vk::Bool32& feature) { feature = VK_TRUE; });
  return chain;
}

bool has_raster_features(const vk::raii::PhysicalDevice& device) {
  auto chain = device.getFeatures2<vk::PhysicalDeviceFeatures2, vk::PhysicalDeviceVulkan12Features,
                                   vk::PhysicalDeviceVulkan13Features>();
  bool all = true;
  for_each_of_raster(chain, [&](vk::Bool32 feature) { all = all && feature != VK_FALSE; });
  return all;
}

const char* missing_feature(const vk::raii::PhysicalDevice& device) {
  auto chain = device.getFeatures2<vk::PhysicalDeviceFeatures2, vk::PhysicalDeviceVulkan12Features,
                                   vk::PhysicalDeviceVulkan13Features>();
  const char* missing = nullptr;
  for_each_required(chain, [&missing](vk::Bool32 feature, const char* name) {
    if (!feature && missing == nullptr) missing = name;
  });
  if (missing != nullptr) return missing;
  const auto subgroups =
      device.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceSubgroupProperties>()
          .get<vk::PhysicalDeviceSubgroupProperties>();
  const bool operations =
      (subgroups.supportedOperations & required_subgroup_operations) == required_subgroup_operations;
  const bool in_compute = bool(subgroups.supportedStages & vk::ShaderStageFlagBits::eCompute);
  return operations && in_compute ? nullptr
                                  : "subgroup vote, ballot, shuffle and arithmetic in compute shaders";
}

}  // namespace rtstdb::gpu
