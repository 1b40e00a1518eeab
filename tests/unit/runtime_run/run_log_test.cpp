#include "runtime/run/run_log.hpp"

#include <gtest/gtest.h>

namespace hil::run {
namespace {

TEST(RunLog, FullDiskIsOneSentence) {
  RunLog log("/dev/full", false);
  testing::internal::CaptureStderr();
  EXPECT_EQ(log.fault(), "");
  log.info("first");
  log.warn("second");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(log.fault(), "run.log could not be written: No space left on device");
}

}  // namespace
}  // namespace hil::run
