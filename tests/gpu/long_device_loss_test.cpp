// The device is lost at each call, where a test does not state another stride.

#include "tests/gpu/device_loss.hpp"

namespace rtstdb::test {
namespace {

using LongDeviceLoss = DeviceLossTest;

TEST_F(LongDeviceLoss, AtACallOfATransactionLeavesNoTrace) {
  lose_at_calls_of_each_kind(1);
}
TEST_F(LongDeviceLoss, DuringARecoveryIsRecoveredFrom) {
  lose_at_calls_of_recovery(1);
}
TEST_F(LongDeviceLoss, WhileGeometryIsAddedIsRecoveredFrom) {
  lose_at_calls_while_geometry_is_added(1);
}
/// Each call leaves four more queries, so a sample is enough.
TEST_F(LongDeviceLoss, WhileQueriesArePreparedIsRecoveredFrom) {
  lose_at_calls_while_queries_are_prepared(7);
}
TEST(LongDeviceLossAtOpen, IsAnErrorWithoutLeaks) {
  lose_at_calls_while_a_database_opens(1);
}

}  // namespace
}  // namespace rtstdb::test
