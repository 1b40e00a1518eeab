#pragma once
// A model of the store: the rows of every version. It shares no code with the store.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <rtstdb/database.hpp>

namespace hil::long_test {

struct ModelWrite {
  enum class Kind : std::uint8_t { create, update, remove } kind = Kind::create;
  rtstdb::EntityId id;
  std::uint32_t mask = 0;
};

struct ModelRow {
  std::uint32_t generation = 0;
  std::uint32_t mask = 0;
  rtstdb::Version written_by = 0;
};

using ModelRows = std::map<std::uint32_t, ModelRow>;  ///< by index

/// Depends on every row of a version.
std::uint64_t digest(const ModelRows& rows);
/// The part of one row.
std::uint64_t row_digest(rtstdb::EntityId id, std::uint32_t mask, rtstdb::Version written_by);

class WorldModel {
 public:
  /// In the order of versions. Returns why the commit is not valid; empty: it is valid.
  std::string commit(rtstdb::Version version, const std::vector<ModelWrite>& writes);
  /// A version that was not published and that the log may have recorded.
  void note_in_doubt(rtstdb::Version version, const std::vector<ModelWrite>& writes);
  /// Recovery found that version: later ones are lost. Returns why it is not valid; empty: it is valid.
  std::string recover_at(rtstdb::Version version);
  /// The rows after the last commit up to that version.
  const ModelRows& rows(rtstdb::Version version) const;
  std::uint64_t digest(rtstdb::Version version) const;
  rtstdb::Version newest() const { return versions_.rbegin()->first; }
  /// The last commit before that version.
  rtstdb::Version before(rtstdb::Version version) const;
  /// Whether the entity exists in every version from that one on.
  bool exists_since(rtstdb::EntityId id, rtstdb::Version version) const;
  void forget_before(rtstdb::Version version);

 private:
  struct VersionState {
    ModelRows rows;
    std::uint64_t digest = 0;
  };
  const VersionState& held(rtstdb::Version version) const;
  /// Changes the rows. Returns why a write is not valid; empty: all are valid.
  static std::string apply(rtstdb::Version version, const std::vector<ModelWrite>& writes, ModelRows& rows);
  std::map<rtstdb::Version, VersionState> versions_{{0, {}}};
  std::map<rtstdb::Version, VersionState> in_doubt_;
};

}  // namespace hil::long_test
