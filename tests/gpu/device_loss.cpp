#include "tests/gpu/device_loss.hpp"

#include "rtstdb/open_database.hpp"

namespace rtstdb::test {
namespace {

using SteadyClock = std::chrono::steady_clock;

/// Longer than all pauses between recovery attempts.
constexpr std::chrono::seconds timeout{60};

/// After call 1 the multiples of `every`.
std::uint64_t next_call(std::uint64_t call, std::uint64_t every) {
  return (call / every + 1) * every;
}

void expect_same_bits(const AnswerBits& answers, const AnswerBits& expected) {
  if (answers == expected) return;
  const auto [at, at_expected] = std::ranges::mismatch(answers, expected);
  ADD_FAILURE() << answers.size() << " words, expected " << expected.size() << "; they differ from word "
                << at - answers.begin() << " on";
}

}  // namespace

void DeviceLossTest::SetUp() {
  lost_.set_up();
  undisturbed_.set_up();
}

void DeviceLossTest::TearDown() {
  for (DeviceLossWorld* world : {&lost_, &undisturbed_}) {
    const std::vector<std::string> messages = world->database().health().validation_messages;
    EXPECT_TRUE(messages.empty()) << messages.front();
  }
}

void DeviceLossTest::expect_same(std::size_t kind, unsigned round) {
  const DeviceLossWorld::TransactionCase& lost_kind = lost_.kinds()[kind];
  const DeviceLossWorld::TransactionCase& undisturbed_kind =
      *std::ranges::find(undisturbed_.kinds(), lost_kind.name, &DeviceLossWorld::TransactionCase::name);
  const Status expected = undisturbed_.execute(undisturbed_kind, round).status;
  ASSERT_TRUE(expected == Status::committed || expected == Status::truncated) << to_string(expected);
  const auto end = SteadyClock::now() + timeout;
  const Outcome* outcome = &lost_.execute(lost_kind, round);
  while (outcome->status == Status::device_lost && SteadyClock::now() < end)
    outcome = &lost_.execute(lost_kind, round);
  ASSERT_EQ(outcome->status, expected) << describe(*outcome);
  expect_same_bits(lost_.answers(lost_kind), undisturbed_.answers(undisturbed_kind));
}

void DeviceLossTest::expect_same_rows() {
  const auto rows = lost_.rows();
  const auto expected = undisturbed_.rows();
  ASSERT_EQ(rows.size(), expected.size());
  for (std::size_t k = 0; k < rows.size(); ++k)
    EXPECT_TRUE(same(rows[k], expected[k])) << "entity " << k;
}

bool DeviceLossTest::lose_at(std::uint64_t call, std::size_t kind, unsigned round) {
  const Version before = lost_.database().latest().version;
  const std::uint64_t losses = lost_.database().health().device_losses;
  loader_.lose_at_call(call);
  const Status status = lost_.execute(lost_.kinds()[kind], round).status;
  const bool enough_calls = loader_.calls() >= call;
  loader_.lose_at_call(0);
  if (enough_calls) {
    EXPECT_EQ(status, Status::device_lost);
    EXPECT_EQ(lost_.database().latest().version, before);
    EXPECT_EQ(lost_.database().health().device_losses, losses + 1);
    expect_same_rows();
    expect_same(kind, round);
  } else {
    // The round is complete.
    const Status expected = undisturbed_.execute(undisturbed_.kinds()[kind], round).status;
    EXPECT_EQ(status, expected);
    expect_same_bits(lost_.answers(lost_.kinds()[kind]), undisturbed_.answers(undisturbed_.kinds()[kind]));
  }
  expect_same_rows();
  return enough_calls;
}

void DeviceLossTest::lose_at_calls_of_each_kind(std::uint64_t every) {
  for (std::size_t kind = 0; kind < lost_.kinds().size(); ++kind) {
    SCOPED_TRACE(lost_.kinds()[kind].name);
    // The first run of a query on a device has more calls.
    expect_same(kind, ++round_);
    for (std::uint64_t call = 1; !HasFatalFailure(); call = next_call(call, every)) {
      SCOPED_TRACE(testing::Message() << "call " << call);
      if (!lose_at(call, kind, ++round_)) break;
    }
  }
}

void DeviceLossTest::lose_at_calls_of_recovery(std::uint64_t every) {
  bool enough_calls = true;
  for (std::uint64_t call = 1; enough_calls && !HasFatalFailure(); call = next_call(call, every)) {
    SCOPED_TRACE(testing::Message() << "call " << call << " after the loss");
    const std::size_t kind = call % lost_.kinds().size();
    loader_.lose_at_call(1);
    ++round_;
    EXPECT_EQ(lost_.execute(lost_.kinds()[kind], round_).status, Status::device_lost);
    loader_.lose_at_call(call);
    expect_same(kind, round_);
    enough_calls = loader_.calls() > call;
    loader_.lose_at_call(0);
    expect_same_rows();
  }
}

void DeviceLossTest::lose_at_calls_while_geometry_is_added(std::uint64_t every) {
  const std::pair<TriangleMesh, GeometryOptions> all[] = {{make_sphere(0.5, 2), {}},
                                                          {make_sphere(0.4, 1), {.deforms = true}}};
  for (const auto& [mesh, options] : all) {
    bool enough_calls = true;
    for (std::uint64_t call = 1; enough_calls && !HasFatalFailure(); call = next_call(call, every)) {
      SCOPED_TRACE(testing::Message() << "call " << call << (options.deforms ? ", deforming" : ""));
      loader_.lose_at_call(call);
      const auto added = lost_.database().add_geometry(mesh, "late", options);
      enough_calls = loader_.calls() >= call;
      loader_.lose_at_call(0);
      const auto expected = undisturbed_.database().add_geometry(mesh, "late", options);
      ASSERT_TRUE(added.ok()) << added.error().message;
      ASSERT_TRUE(expected.ok()) << expected.error().message;
      EXPECT_EQ(added.value(), expected.value());
      lost_.show_as(added.value());
      undisturbed_.show_as(expected.value());
      expect_same(call % lost_.kinds().size(), ++round_);
      expect_same(lost_.kinds().size() - 2, ++round_);
    }
  }
}

void DeviceLossTest::lose_at_calls_while_queries_are_prepared(std::uint64_t every) {
  for (const int step : DeviceLossWorld::query_steps()) {
    bool enough_calls = true;
    for (std::uint64_t call = 1; enough_calls && !HasFatalFailure(); call = next_call(call, every)) {
      SCOPED_TRACE(testing::Message() << "call " << call << " of step " << step);
      const std::size_t first_new = lost_.kinds().size();
      loader_.lose_at_call(call);
      const auto prepared = lost_.set_up(step);
      enough_calls = loader_.calls() >= call;
      loader_.lose_at_call(0);
      ASSERT_TRUE(prepared.ok()) << prepared.error().message;
      for (std::size_t kind = first_new; kind < lost_.kinds().size(); ++kind)
        expect_same(kind, ++round_);
    }
  }
}

void lose_at_calls_while_a_database_opens(std::uint64_t every) {
  gpu::test::FaultLoader loader;
  for (std::uint64_t call = 1;; call = next_call(call, every)) {
    SCOPED_TRACE(testing::Message() << "call " << call);
    loader.lose_at_call(call);
    auto opened = open_database({.max_entities = 16}, {.loader_library = FAULT_LOADER});
    const bool enough_calls = loader.calls() >= call;
    loader.lose_at_call(0);
    EXPECT_EQ(opened.ok(), !enough_calls);
    if (!opened) {
      EXPECT_EQ(opened.error().code, ErrorCode::device_lost) << opened.error().message;
    }
    opened = Error{};
    EXPECT_EQ(loader.live_devices(), 0);
    EXPECT_EQ(loader.live_allocations(), 0);
    if (!enough_calls) break;
  }
}

}  // namespace rtstdb::test
