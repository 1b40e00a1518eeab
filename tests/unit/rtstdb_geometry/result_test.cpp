// Misuse of results, and the names of enumerators.

#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <string>

#include <rtstdb/database.hpp>
#include <rtstdb/durability.hpp>
#include <rtstdb/log.hpp>

#include "tests/paths.h"
#include "tests/support/temporary_folder.hpp"

namespace rtstdb {
namespace {

TEST(ResultDeathTest, TheValueOfAnErrorAbortsWithItsMessage) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_DEATH(static_cast<void>(load_mesh("/nope.obj").value()),
               "rtstdb was misused: Result::value: .* file: mesh file '/nope.obj' does not exist");
  const Result<TriangleMesh> constant = load_mesh("/nope.obj");
  EXPECT_DEATH(static_cast<void>(constant.value()), "'/nope.obj' does not exist");
  Result<TriangleMesh> named = load_mesh("/nope.obj");
  EXPECT_DEATH(named.value().triangles.clear(), "'/nope.obj' does not exist");
  EXPECT_DEATH(validate({}).value(), "bad_input: the mesh has no triangle");
}

TEST(ResultDeathTest, TheErrorOfASuccessIsMisuse) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const TriangleMesh box = make_box({1.0, 1.0, 1.0});
  EXPECT_DEATH(static_cast<void>(validate(box).error()), "Result::error: the result holds no error");
  const Result<TriangleMesh> good(box);
  EXPECT_DEATH(static_cast<void>(good.error()), "Result::error: the result holds no error");
}

TEST(Enumerators, InPublicHeadersHaveNames) {
  std::string all;
  for (const auto& file : std::filesystem::directory_iterator(HIL_SOURCE_DIR "/rtstdb/include/rtstdb"))
    all += hil::tests::content_of(file.path());
  const std::regex declared("enum class ([A-Za-z]+)");
  std::size_t found = 0;
  for (std::sregex_iterator it(all.begin(), all.end(), declared), end; it != end; ++it, ++found) {
    const std::string name = (*it)[1];
    EXPECT_TRUE(std::regex_search(all, std::regex("to_string\\((\\w+::)?" + name + " \\w+\\)"))) << name;
  }
  EXPECT_GT(found, 20u);
}

TEST(Enumerators, HaveTheNamesOfTheHeaders) {
  EXPECT_STREQ(to_string(ErrorCode::out_of_memory), "out_of_memory");
  EXPECT_STREQ(to_string(LatePolicy::last_good), "last_good");
  EXPECT_STREQ(to_string(RayMode::first), "first");
  EXPECT_STREQ(to_string(Faces::back), "back");
  EXPECT_STREQ(to_string(HitStatus::incomplete), "incomplete");
  EXPECT_STREQ(to_string(RegionLevel::triangle), "triangle");
  EXPECT_STREQ(to_string(RegionShape::frustum), "frustum");
  EXPECT_STREQ(to_string(RegionTest::inside), "inside");
  EXPECT_STREQ(to_string(NearestTarget::surface), "surface");
  EXPECT_STREQ(to_string(ReadAt::Kind::version), "version");
  EXPECT_STREQ(to_string(CancelledBy::full_queue), "full_queue");
  EXPECT_STREQ(to_string(Validation::build_default), "build_default");
  EXPECT_STREQ(to_string(StandingTarget::center), "center");
  EXPECT_STREQ(to_string(static_cast<RayMode>(9)), "unknown");
}

}  // namespace
}  // namespace rtstdb
