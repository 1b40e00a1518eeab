#pragma once
// The registry of query kinds on the GPU side: one function per line of rtstdb/query_kinds.def. Each is
// defined in the folder of its kind.

#include <memory>
#include <utility>

#include "rtstdb/query/gpu_query.hpp"

namespace rtstdb::query {

// Makes a query on a device. Errors: bad_input and capacity for options that are not allowed; what the device
// can not hold.
#define QUERY_KIND(kind, Class, Element, elements, Answer, answers, ...) \
  Result<std::unique_ptr<GpuQuery>> make_query(gpu::Device& device, const Class##Options& options);
#include <rtstdb/query_kinds.def>
#undef QUERY_KIND

/// A query of any kind, whose late policy is checked here. Errors: see above.
Result<std::unique_ptr<GpuQuery>> make_any_query(gpu::Device& device, QueryOptionsRef options);

/// Creates on the device what a new query needs.
template <class Kind>
Result<std::unique_ptr<GpuQuery>> on_device(std::unique_ptr<Kind> query, gpu::Device& device) {
  if (auto moved = query->move_to(device); !moved) return moved.error();
  return std::unique_ptr<GpuQuery>(std::move(query));
}

}  // namespace rtstdb::query
