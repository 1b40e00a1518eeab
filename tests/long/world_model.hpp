#pragma once
// The simplest world that commits can be carried out on: what every version of it holds. Shares no code with
// the store.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <rtstdb/database.hpp>

namespace hil::stress {

struct ModelWrite {
  enum class Kind : std::uint8_t { create, update, remove } kind = Kind::create;
  rtstdb::EntityId id;
  std::uint32_t material = 0;
};

struct ModelRow {
  std::uint32_t generation = 0;
  std::uint32_t material = 0;
  rtstdb::Version written_by = 0;
};

using ModelRows = std::map<std::uint32_t, ModelRow>;  ///< by index

/// Of all rows of a version: any difference changes it.
std::uint64_t digest(const ModelRows& rows);
/// What a row adds to it.
std::uint64_t row_digest(rtstdb::EntityId id, std::uint32_t material, rtstdb::Version written_by);

class WorldModel {
 public:
  /// Commits come in the order of their versions. What does not fit is told: empty, or the fault in words.
  std::string commit(rtstdb::Version version, const std::vector<ModelWrite>& writes);
  /// Nobody could read it, and nobody knows whether a log tells of it.
  void may_stand(rtstdb::Version version, const std::vector<ModelWrite>& writes);
  /// Whoever opened the database again found that version: what came after it never was. What does not fit is
  /// told.
  std::string go_on_at(rtstdb::Version version);
  /// The rows of a version: those of the last commit up to it.
  const ModelRows& rows(rtstdb::Version version) const;
  std::uint64_t digest(rtstdb::Version version) const;
  rtstdb::Version newest() const { return versions_.rbegin()->first; }
  /// The last commit before that version.
  rtstdb::Version before(rtstdb::Version version) const;
  /// Whether the entity lives in every version from that one on.
  bool lives_since(rtstdb::EntityId id, rtstdb::Version version) const;
  /// Forgets versions below.
  void forget_before(rtstdb::Version version);

 private:
  struct Held {
    ModelRows rows;
    std::uint64_t digest = 0;
  };
  const Held& held(rtstdb::Version version) const;
  /// What a set leaves behind of the rows before it. What does not fit is told.
  static std::string apply(rtstdb::Version version, const std::vector<ModelWrite>& writes, ModelRows& rows);
  std::map<rtstdb::Version, Held> versions_{{0, {}}};
  std::map<rtstdb::Version, Held> doubtful_;
};

}  // namespace hil::stress
