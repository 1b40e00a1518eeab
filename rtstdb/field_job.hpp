#pragma once
// Builds the distance field of a geometry on the device, in parts between which the engine runs transactions.

#include <rtstdb/field.hpp>
#include <rtstdb/geometry.hpp>
#include <rtstdb/result.hpp>
#include <rtstdb/time.hpp>

#include "rtstdb/query/gpu_executor.hpp"
#include "rtstdb/transaction/engine.hpp"

namespace rtstdb {

struct FieldJob {
  transaction::Engine& engine;
  query::GpuExecutor& executor;
  /// Wanted device time of a part, for which transactions may wait. Zero: parts are as large as possible.
  Nanoseconds part{0};

  /// Builds and attaches the field. The options have passed check_options; the mesh is that of the geometry,
  /// which is on the device and has no field. Blocks; not the engine thread.
  /// Errors: bad_input, capacity: those of field::FieldBuild; out_of_memory, device_lost.
  Result<FieldReport> run(GeometryId geometry, const TriangleMesh& mesh, const FieldOptions& options) const;
};

}  // namespace rtstdb
