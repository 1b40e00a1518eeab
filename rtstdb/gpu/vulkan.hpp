#pragma once
// Includes Vulkan-Hpp for the sources of this folder. No header that other folders include may include this
// one. The loader library is opened at run time (loader.hpp), so that a program on a machine without it
// starts and reports an error.

#define VULKAN_HPP_ENABLE_DYNAMIC_LOADER_TOOL 0
#define VULKAN_HPP_NO_SMART_HANDLE
#include <vulkan/vulkan_raii.hpp>

#include <string_view>

#include <rtstdb/result.hpp>

namespace rtstdb::gpu {

/// Maps a failed setup call to an Error whose text begins with `what`.
Error to_error(const vk::SystemError& failure, std::string_view what);

}  // namespace rtstdb::gpu
