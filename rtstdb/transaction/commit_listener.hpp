#pragma once
// Receives each commit.

#include "rtstdb/store/write_set.hpp"

namespace rtstdb::transaction {

class CommitListener {
 public:
  virtual ~CommitListener() = default;
  /// The set was published and its commit is complete. The set is as staging has left it; after the call its
  /// memory belongs to its owner. Called on the thread that committed it, one call at a time, in the order of
  /// versions, before Engine::latest returns the version. In the tick: must not allocate or block.
  virtual void committed(const store::WriteSet& set) noexcept = 0;
};

}  // namespace rtstdb::transaction
