#pragma once
// A standing query whose entities are examined independently of one another: regions and rays.

#include "rtstdb/standing/watch.hpp"

namespace rtstdb::standing {

class MembershipWatch final : public Watch {
 public:
  using Watch::Watch;

 private:
  void on_due(const Certificate& certificate) override;
  void reevaluate(std::span<const std::uint32_t> indices, std::int64_t now_ns, EventCause cause) override;
  void reevaluate_all(std::int64_t now_ns, EventCause cause) override;
  void examine(std::uint32_t index, std::int64_t now_ns, EventCause cause);
};

}  // namespace rtstdb::standing
