#pragma once
// Whether the chaser touches the ring of a docking port, and how fast it closed in when the touch began.
//
// Threads: prepare at setup; all else in the tick, without allocation.

#include <memory>
#include <string>

#include <rtstdb/database.hpp>

namespace hil::modules {

class PortContact {
 public:
  /// Errors: those of Database::prepare.
  static rtstdb::Result<std::unique_ptr<PortContact>> prepare(rtstdb::Database& database,
                                                              const std::string& name,
                                                              rtstdb::EntityId chaser, rtstdb::EntityId ring);

  /// Adds the query at an instant to a transaction that is being declared.
  void add_to(rtstdb::Transaction& transaction, rtstdb::WorldTime t) noexcept;
  /// Takes the answer of that transaction, which was done, with the closing speed at its instant. True: a
  /// touch has begun. Without a decision of the query the state stays as it was, and no touch begins.
  bool take(double closing_speed_mps) noexcept;

  double touches() const noexcept { return touches_; }  ///< that began so far
  /// Of the touch that began last: the larger closing speed of the answer before it and of its first answer,
  /// since the contact slows the chaser down. 0 before.
  double speed_mps() const noexcept { return speed_mps_; }
  double undecided() const noexcept { return undecided_; }  ///< answers so far

 private:
  PortContact(rtstdb::EntityId chaser, rtstdb::EntityId ring) : chaser_(chaser), ring_(ring) {}

  const rtstdb::EntityId chaser_, ring_;
  std::unique_ptr<rtstdb::ContactQuery> query_;
  bool is_touching_ = false;
  double touches_ = 0.0, speed_mps_ = 0.0, undecided_ = 0.0;
  double speed_before_mps_ = 0.0;  ///< at the last answer
};

}  // namespace hil::modules
