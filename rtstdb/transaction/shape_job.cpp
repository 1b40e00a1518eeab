#include "rtstdb/transaction/shape_job.hpp"

#include <utility>
#include <variant>

namespace rtstdb::transaction {

bool ShapeJob::step(const store::Store& store) noexcept {
  const auto found = store.read(read_at_, store::ReadFor::rows_and_shapes);
  if (const auto* fault = std::get_if<BadInput>(&found)) {
    fault_ = *fault;
    return true;
  }
  const store::Shape shape = std::get_if<store::Snapshot>(&found)->shape(geometry_);
  positions_m_.assign(shape.positions_m.begin(), shape.positions_m.end());
  return true;
}

Result<std::vector<glm::vec3>> ShapeJob::take() && {
  if (fault_) return Error{ErrorCode::bad_input, describe(*fault_)};
  return std::move(positions_m_);
}

}  // namespace rtstdb::transaction
