// Random worlds, random cones: every answer of the GPU against the oracle's.

#include <ostream>
#include <string>

#include "tests/gpu/random_questions.hpp"

namespace rtstdb::test {
namespace {

struct Case {
  const char* name;
  RandomWorld world;
  std::size_t cones;
};

std::ostream& operator<<(std::ostream& out, const Case& one) {
  return out << one.name;
}

constexpr Case cases[] = {
    {"one_entity", {10, 1, 0.3}, 8'000},
    {"nine", {3, 9, 2.0}, 8'000},
    {"sixty", {4, 60, 5.0}, 8'000},
    {"four_hundred", {5, 400, 14.0}, 4'000},
    {"first_large_build", {7, 2049, 30.0}, 2'000},
};

class RandomCones : public RandomQuestions, public testing::WithParamInterface<Case> {};

TEST_P(RandomCones, FirstContactsAgreeWithTheOracle) {
  fill(GetParam().world);
  Tally tally = ask(ConeQueryOptions{.name = "cones"}, GetParam().cones / 2);
  tally += ask(ConeQueryOptions{.name = "cones", .faces = Faces::front}, GetParam().cones / 8);
  tally += ask(ConeQueryOptions{.name = "cones", .faces = Faces::back}, GetParam().cones / 8);
  expect_telling(tally, 0.02);
}

TEST_P(RandomCones, SeveralReturnsAgreeWithTheOracle) {
  fill(GetParam().world);
  expect_telling(ask(ConeQueryOptions{.name = "cones", .returns_per_cone = 8}, GetParam().cones / 4), 0.03);
}

TEST_P(RandomCones, FractionsAgreeWithTheOracle) {
  fill(GetParam().world);
  const ConeQueryOptions options{.name = "cones", .returns_per_cone = 8, .fractions = true};
  expect_telling(ask(options, GetParam().cones / 16), 0.1);
}

INSTANTIATE_TEST_SUITE_P(Sizes, RandomCones, testing::ValuesIn(cases),
                         [](const auto& one) { return std::string(one.param.name); });

}  // namespace
}  // namespace rtstdb::test
