#pragma once
// How many pixels of an image bodies would cover alone: those where they are seen, and those where others
// hide them.
//
// A pixel may hide a body where its ray is inside the body's box behind what the pixel shows. The ray then
// lists the surfaces that it meets in the box; one of the body's own among them decides that the body is
// hidden here. A pixel is undecided if the list is full without one, or the search was cut short.
//
// Threads: prepare at setup; count in the tick, without allocation.

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <hil/world/world_module.hpp>
#include <rtstdb/database.hpp>

#include "runtime/modules/camera/box_in_row.hpp"

namespace hil::modules {

/// A body in an image, and the pixels in which it is hidden.
struct CoveredBody {
  rtstdb::EntityId entity{};
  BodyBox box{};
  std::uint32_t hidden = 0, undecided = 0;
};

class VisibleShare {
 public:
  /// Rays of one transaction. More candidates take further ones.
  static constexpr std::uint32_t batch = 8192;

  /// Throws SetupError. `caller`: as "module front".
  void prepare(rtstdb::Database& database, const std::string& name, const std::string& caller);

  /// Counts hidden and undecided pixels of the bodies in an image of the view, which has identities and
  /// depths. The searches have the terms `terms`.
  void count(WorldStep& context, const rtstdb::Terms& terms, const CameraView& view,
             const rtstdb::Image& image, std::span<CoveredBody> bodies) noexcept;

 private:
  void search(WorldStep& context, const rtstdb::Terms& terms, std::span<CoveredBody> bodies) noexcept;

  rtstdb::Database* database_ = nullptr;
  std::unique_ptr<rtstdb::RayQuery> rays_;
  std::unique_ptr<rtstdb::Transaction> transaction_;
  std::vector<std::uint32_t> body_of_ray_;
  std::uint32_t filled_ = 0;
};

}  // namespace hil::modules
