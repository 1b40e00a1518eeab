#include "rtstdb/log/directory.hpp"

#include <algorithm>
#include <charconv>
#include <optional>

namespace rtstdb::log {
namespace {

constexpr std::string_view segment_prefix = "segment.";
constexpr std::string_view checkpoint_prefix = "checkpoint.";
constexpr std::string_view geometry_prefix = "geometry.";
constexpr std::string_view unfinished_suffix = ".new";
constexpr std::string_view abandoned_suffix = ".abandoned";
constexpr std::size_t digits = 10;

std::string numbered(std::string_view prefix, std::uint64_t number) {
  const std::string plain = std::to_string(number);
  return std::string(prefix) + std::string(digits - std::min(digits, plain.size()), '0') + plain;
}

/// The number in `name`; none unless `name` is exactly the name of the file with that number.
std::optional<std::uint64_t> number_of(std::string_view name, std::string_view prefix,
                                       std::string_view suffix) {
  if (!name.starts_with(prefix) || !name.ends_with(suffix)) return std::nullopt;
  const std::string_view text = name.substr(prefix.size(), name.size() - prefix.size() - suffix.size());
  std::uint64_t number = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (fault != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if (numbered(prefix, number) != name.substr(0, name.size() - suffix.size())) return std::nullopt;
  return number;
}

}  // namespace

std::string segment_name(std::uint64_t number) {
  return numbered(segment_prefix, number);
}
std::string checkpoint_name(std::uint64_t number) {
  return numbered(checkpoint_prefix, number);
}
std::string unfinished_segment_name(std::uint64_t number) {
  return segment_name(number) + std::string(unfinished_suffix);
}
std::string unfinished_checkpoint_name(std::uint64_t number) {
  return checkpoint_name(number) + std::string(unfinished_suffix);
}
std::string abandoned_checkpoint_name(std::uint64_t number) {
  return checkpoint_name(number) + std::string(abandoned_suffix);
}
std::string geometry_name(std::uint64_t number) {
  return numbered(geometry_prefix, number);
}

DiskResult<Listing> list_log(Disk& disk) {
  auto names = disk.list();
  if (!names) return names.error();
  Listing listing;
  for (const std::string& name : names.value()) {
    if (const auto number = number_of(name, segment_prefix, "")) listing.segments.push_back(*number);
    if (const auto number = number_of(name, checkpoint_prefix, "")) listing.checkpoints.push_back(*number);
    if (const auto number = number_of(name, segment_prefix, unfinished_suffix))
      listing.unfinished_segments.push_back(*number);
    if (const auto number = number_of(name, checkpoint_prefix, unfinished_suffix))
      listing.unfinished_checkpoints.push_back(*number);
    if (const auto number = number_of(name, checkpoint_prefix, abandoned_suffix))
      listing.abandoned_checkpoints.push_back(*number);
    if (const auto number = number_of(name, geometry_prefix, "")) listing.geometries.push_back(*number);
  }
  for (auto* numbers :
       {&listing.segments, &listing.checkpoints, &listing.geometries, &listing.unfinished_segments,
        &listing.unfinished_checkpoints, &listing.abandoned_checkpoints})
    std::ranges::sort(*numbers);
  return listing;
}

}  // namespace rtstdb::log
