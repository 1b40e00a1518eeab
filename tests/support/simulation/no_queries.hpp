#pragma once
// The executor of a database without queries.

#include "rtstdb/query/executor.hpp"

namespace hil::tests {

class NoQueries final : public rtstdb::query::Executor {
 public:
  rtstdb::query::RunReport run(const rtstdb::store::RowSource&, std::span<const rtstdb::query::Request>,
                               const rtstdb::store::TimeSpan&,
                               rtstdb::query::ExecutorCallbacks*) noexcept override {
    return {};
  }
};

}  // namespace hil::tests
