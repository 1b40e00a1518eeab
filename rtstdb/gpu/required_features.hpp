#pragma once
// The features that rtstdb needs beyond the minimum of Vulkan 1.3. One list serves the check of a device and
// its creation.

#include "rtstdb/gpu/vulkan.hpp"

namespace rtstdb::gpu {

using FeatureChain = vk::StructureChain<vk::PhysicalDeviceFeatures2, vk::PhysicalDeviceVulkan12Features,
                                        vk::PhysicalDeviceVulkan13Features>;

/// A chain that switches on the required features, those of the rasteriser on a device that can draw, and no
/// others.
FeatureChain required_features(bool draws);

/// Whether the device has what the rasteriser needs beside a queue for graphics.
bool has_raster_features(const vk::raii::PhysicalDevice& device);

/// The name of the first missing feature, or null. The device must support Vulkan 1.3 or later.
const char* missing_feature(const vk::raii::PhysicalDevice& device);

}  // namespace rtstdb::gpu
