#pragma once

#include <gtest/gtest.h>

#include "runtime/signals/signal_table.hpp"

namespace hil::run::test {

/// Counts the reads of a signal by tasks.
class CountedReads final : public signals::ReadObserver {
 public:
  void note_read(signals::ReadBy by) noexcept override {
    EXPECT_EQ(by, signals::ReadBy::task);
    ++count;
  }
  int count = 0;
};

}  // namespace hil::run::test
