#pragma once
// What a device must be able to do beyond the minimum of Vulkan 1.3; one list for the check and for the
// request.

#include "rtstdb/gpu/vulkan.hpp"

namespace rtstdb::gpu {

using FeatureChain = vk::StructureChain<vk::PhysicalDeviceFeatures2, vk::PhysicalDeviceVulkan12Features,
                                        vk::PhysicalDeviceVulkan13Features>;

/// The features to switch on, and nothing else.
FeatureChain required_features();

/// The name of the first thing missing, or null. The device must be of Vulkan 1.3 or later.
const char* missing_feature(const vk::raii::PhysicalDevice& device);

}  // namespace rtstdb::gpu
