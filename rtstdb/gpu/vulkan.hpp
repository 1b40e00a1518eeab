#pragma once
// Vulkan for the sources of this folder alone; no header that others include may include this one.
// The loader library is opened at run time (loader.hpp), so that a machine without it gets a sentence instead
// of a program that does not start.

#define VULKAN_HPP_ENABLE_DYNAMIC_LOADER_TOOL 0
#define VULKAN_HPP_NO_SMART_HANDLE
#include <vulkan/vulkan_raii.hpp>

#include <string_view>

#include <rtstdb/result.hpp>

namespace rtstdb::gpu {

/// What a failed setup call means to the caller. `what` begins the sentence.
Error to_error(const vk::SystemError& failure, std::string_view what);

}  // namespace rtstdb::gpu
