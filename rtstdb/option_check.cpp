#include "rtstdb/option_check.hpp"

#include <string>

#include <rtstdb/limits.hpp>

#include "rtstdb/field/field_build.hpp"

namespace rtstdb {
namespace {

bool is_option_duration(Nanoseconds duration) {
  return duration >= Nanoseconds(0) && duration <= Nanoseconds(max_option_duration_ns);
}

std::string refused_duration(const char* name, Nanoseconds duration) {
  return std::string(name) + " is " + std::to_string(duration.count()) + " ns; 0 to " +
         std::to_string(max_option_duration_ns) + " are allowed";
}

}  // namespace

Result<void> check_options(const DatabaseOptions& options) {
  struct Count {
    const char* name;
    std::uint64_t value, limit;
  };
  for (const auto& [name, value, limit] :
       {Count{"max_entities", options.max_entities, max_entities},
        Count{"max_geometries", options.max_geometries, max_geometries},
        Count{"queue_capacity", options.queue_capacity, max_queue_capacity},
        Count{"retained_changes", options.retained_changes, max_retained_changes}}) {
    if (value == 0 || value > limit)
      return Error{ErrorCode::capacity, std::string(name) + " is " + std::to_string(value) + "; 1 to " +
                                            std::to_string(limit) + " are allowed"};
  }
  if (!is_option_duration(options.chunk))
    return Error{ErrorCode::bad_input, refused_duration("chunk", options.chunk)};
  if (options.thread_priority < 0 || options.thread_priority > 99)
    return Error{ErrorCode::bad_input, "thread_priority is " + std::to_string(options.thread_priority) +
                                           "; 0, ordinary, and 1 to 99 are allowed"};
  return {};
}

Result<void> check_options(const DurabilityOptions& options) {
  const auto refuse = [](const std::string& what) {
    return Error{ErrorCode::bad_input, "durability: " + what};
  };
  const std::string mode = to_string(options.mode);
  if (options.directory.empty()) {
    if (options.mode == DurabilityMode::group || options.mode == DurabilityMode::sync)
      return refuse("mode " + mode + " needs a directory");
    return {};
  }
  if (options.mode == DurabilityMode::volatile_only)
    return refuse("mode volatile does not allow a directory, given is " + options.directory.string());
  if (!is_option_duration(options.flush_interval))
    return refuse(refused_duration("flush_interval", options.flush_interval));
  if (options.ring_bytes < min_ring_bytes || options.ring_bytes > max_ring_bytes)
    return refuse("ring_bytes is " + std::to_string(options.ring_bytes) + "; " +
                  std::to_string(min_ring_bytes) + " to " + std::to_string(max_ring_bytes) + " are allowed");
  if (options.segment_bytes < min_segment_bytes)
    return refuse("segment_bytes is " + std::to_string(options.segment_bytes) + "; " +
                  std::to_string(min_segment_bytes) + " and more are allowed");
  return {};
}

Result<void> check_options(const GeometryOptions& options) {
  if (options.deforms && !options.convex_parts_m.empty())
    return Error{ErrorCode::bad_input, "a geometry that deforms can not have convex parts"};
  if (options.deforms && options.solid)
    return Error{ErrorCode::bad_input, "a geometry that deforms can not be a solid"};
  if (options.solid && !options.convex_parts_m.empty())
    return Error{ErrorCode::bad_input, "a geometry that is a solid can not have convex parts"};
  if (options.field) {
    if (options.deforms)
      return Error{ErrorCode::bad_input, "a geometry that deforms can not have a distance field"};
    return field::check_field_options(*options.field);
  }
  if (!options.deforms) return {};
  if (options.retained_shapes == 0 || options.retained_shapes > max_retained_shapes)
    return Error{ErrorCode::bad_input, "retained_shapes is " + std::to_string(options.retained_shapes) +
                                           "; 1 to " + std::to_string(max_retained_shapes) + " are allowed"};
  if (!(options.rebuild_growth >= 1.0f)) {
    return Error{ErrorCode::bad_input,
                 "rebuild_growth is " + std::to_string(options.rebuild_growth) + "; 1 and more are allowed"};
  }
  return {};
}

}  // namespace rtstdb
