#pragma once
// Chooses a physical device. Free of Vulkan types, so that unit tests can pass any list of candidates.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include <rtstdb/database.hpp>
#include <rtstdb/result.hpp>

namespace rtstdb::gpu {

/// In the order in which "auto" prefers them.
enum class DeviceKind : std::uint8_t { discrete, integrated, virtual_gpu, cpu, other };

struct Candidate {
  DeviceInfo info;
  DeviceKind kind = DeviceKind::other;
  std::string unsuitable;  ///< why rtstdb can not use the device; empty: it can
};

/// Returns an index into `candidates`. `select` is an index ("0"), a part of a name (case insensitive; takes
/// the first suitable match in order of preference), or "auto". Of devices of equal kind the lower index is
/// chosen. Errors: no_device, with what was sought, what there is, and what to install.
Result<std::size_t> choose_device(std::string_view select, std::span<const Candidate> candidates);

}  // namespace rtstdb::gpu
