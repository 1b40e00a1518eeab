#pragma once
// Which device is taken, apart from Vulkan so that it can be tried on lists that this machine does not have.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include <rtstdb/database.hpp>
#include <rtstdb/result.hpp>

namespace rtstdb::gpu {

/// In the order of preference of "auto".
enum class DeviceKind : std::uint8_t { discrete, integrated, virtual_gpu, cpu, other };

struct Candidate {
  DeviceInfo info;
  DeviceKind kind = DeviceKind::other;
  std::string unfit;  ///< why rtstdb can not use it, in words; empty: it can
};

/// Index into `candidates`. `select`: an index ("0"), a part of a name (case does not matter; the first fit
/// one in order of preference), or "auto". Equal kinds: the lower index. Errors: no_device, with what was
/// looked for, what there is, and what to install.
Result<std::size_t> choose_device(std::string_view select, std::span<const Candidate> candidates);

}  // namespace rtstdb::gpu
