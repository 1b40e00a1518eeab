#pragma once
// Who wants to know what is committed.

#include "rtstdb/store/write_set.hpp"

namespace rtstdb::transaction {

class CommitListener {
 public:
  virtual ~CommitListener() = default;
  /// A set has been published and settled, and is whole as staging left it; its memory is its owner's again afterwards. By the thread
  /// that committed it, one at a time and in the order of versions, before Engine::latest tells of it. In the tick.
  virtual void committed(const store::WriteSet& set) noexcept = 0;
};

}  // namespace rtstdb::transaction
