#include "rtstdb/gpu/device_choice.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <optional>

namespace rtstdb::gpu {
namespace {

constexpr std::string_view install_hint =
    "install a Vulkan 1.3 driver (Debian: mesa-vulkan-drivers, which also holds the software device "
    "llvmpipe)";

std::optional<std::size_t> as_index(std::string_view text) {
  std::size_t index = 0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, index);
  if (text.empty() || stop != end || error != std::errc()) return std::nullopt;
  return index;
}

bool contains_ignoring_case(std::string_view text, std::string_view part) {
  const auto same = [](unsigned char a, unsigned char b) { return std::tolower(a) == std::tolower(b); };
  return std::search(text.begin(), text.end(), part.begin(), part.end(), same) != text.end();
}

std::string list_of(std::span<const Candidate> candidates) {
  std::string text;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (i != 0) text += ", ";
    text += std::to_string(i) + " \"" + candidates[i].info.name + "\"";
    if (!candidates[i].unsuitable.empty()) text += " (unsuitable: " + candidates[i].unsuitable + ")";
  }
  return text;
}

Error no_device_error(std::string_view sought, std::span<const Candidate> candidates) {
  std::string message = "no Vulkan device: sought " + std::string(sought) + ", found ";
  message += candidates.empty() ? "none" : list_of(candidates);
  // If a suitable device exists, the error suggests another choice; otherwise it suggests to install a
  // driver.
  const bool any_suitable = std::any_of(candidates.begin(), candidates.end(),
                                        [](const Candidate& c) { return c.unsuitable.empty(); });
  message += "; ";
  message += any_suitable ? "choose one of these or \"auto\"" : install_hint;
  return {ErrorCode::no_device, message};
}

}  // namespace

Result<std::size_t> choose_device(std::string_view select, std::span<const Candidate> candidates) {
  if (const auto index = as_index(select)) {
    if (*index < candidates.size() && candidates[*index].unsuitable.empty()) return *index;
    return no_device_error("index " + std::string(select), candidates);
  }
  const bool by_name = select != "auto";
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Candidate& candidate = candidates[i];
    if (!candidate.unsuitable.empty()) continue;
    if (by_name && !contains_ignoring_case(candidate.info.name, select)) continue;
    if (!best || candidate.kind < candidates[*best].kind) best = i;
  }
  if (best) return *best;
  return no_device_error(by_name ? "a name with \"" + std::string(select) + "\"" : "any", candidates);
}

}  // namespace rtstdb::gpu
