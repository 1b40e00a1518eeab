// The answers to the elements of a batch depend neither on the run, nor on their order, nor on how they are
// split into batches, nor on the times of other elements. For queries of every kind.

#include <algorithm>
#include <numeric>
#include <random>
#include <vector>

#include "tests/gpu/kind_cases.hpp"
#include "tests/gpu/random_queries.hpp"

namespace rtstdb::test {
namespace {

class SameAnswers : public RandomQueries {
 protected:
  static std::uint32_t count_of(const AnyQueryOptions& options) { return is_expensive(options) ? 45 : 450; }
  static std::vector<std::uint32_t> places_of(std::uint32_t count) {
    std::vector<std::uint32_t> places(count);
    std::iota(places.begin(), places.end(), 0u);
    return places;
  }
  void fill_world(std::uint32_t entities) {
    open({});
    fill({.seed = 78, .entities = entities, .radius_m = entities > 2048 ? 36.0 : 10.0});
  }
  /// A query of `capacity` random elements within the window; equal calls give equal elements.
  std::unique_ptr<KindCase> random_case(const AnyQueryOptions& options, std::uint32_t capacity,
                                        double window_s) {
    auto query = prepare_case(database(), with(options, capacity));
    Random random(79);
    query->fill(random, {oracle_world().entities(), scene(), scene().version_time + Nanoseconds(400'000'000),
                         window_s});
    return query;
  }
  std::vector<Words> answers_of(KindCase& query) {
    const Outcome outcome = run(query.query(), query.capacity());
    EXPECT_TRUE(outcome.done()) << describe(outcome);
    return query.words();
  }
  /// The answers to the elements of `all` at these places, in batches of `capacity`.
  std::vector<Words> answers_in_batches(KindCase& all, const AnyQueryOptions& options,
                                        std::span<const std::uint32_t> places, std::uint32_t capacity) {
    const auto query = prepare_case(database(), with(options, capacity));
    std::vector<Words> answers;
    for (std::size_t first = 0; first < places.size(); first += capacity) {
      const auto part = places.subspan(first, std::min<std::size_t>(capacity, places.size() - first));
      query->copy_elements(all, part);
      EXPECT_TRUE(run(query->query(), part.size()).done());
      const std::vector<Words> words = query->words();
      answers.insert(answers.end(), words.begin(), words.end());
    }
    return answers;
  }
  /// Answers in the order of `places`, put back to the order of the places.
  static std::vector<Words> in_order(const std::vector<Words>& answers,
                                     std::span<const std::uint32_t> places) {
    const std::size_t per_element = answers.size() / places.size();
    std::vector<Words> ordered(answers.size());
    for (std::size_t i = 0; i < answers.size(); ++i)
      ordered[places[i / per_element] * per_element + i % per_element] = answers[i];
    return ordered;
  }
};

TEST_F(SameAnswers, InEveryRunOrderAndSplit) {
  for (const std::uint32_t entities : {200u, 2500u}) {
    std::vector<std::vector<Words>> first_run;
    fill_world(entities);
    for (const AnyQueryOptions& options : all_tested_options()) {
      const std::uint32_t count = count_of(options);
      const std::vector<std::uint32_t> places = places_of(count);
      const auto all = random_case(options, count, 0.6);
      SCOPED_TRACE(testing::Message() << all->name() << ", " << entities << " entities");
      const std::vector<Words> answers = first_run.emplace_back(answers_of(*all));
      for (const std::uint32_t capacity : {count * 3 / 4, 7u})
        EXPECT_TRUE(have_equal_answers(answers_in_batches(*all, options, places, capacity), answers))
            << "in batches of " << capacity;
      auto shuffled = places;
      for (unsigned seed = 0; seed < 2; ++seed) {
        std::ranges::shuffle(shuffled, std::mt19937(seed));
        EXPECT_TRUE(have_equal_answers(in_order(answers_in_batches(*all, options, shuffled, count), shuffled),
                                       answers))
            << "in random order " << seed;
      }
    }
    fill_world(entities);
    std::size_t k = 0;
    for (const AnyQueryOptions& options : all_tested_options())
      EXPECT_TRUE(
          have_equal_answers(answers_of(*random_case(options, count_of(options), 0.6)), first_run[k++]))
          << "in a second run";
  }
}

/// Different kernels search a batch at one instant and a batch over a window of time.
TEST_F(SameAnswers, AtOneInstantAndBesideElementsAtOtherTimes) {
  for (const std::uint32_t entities : {200u, 2500u}) {
    fill_world(entities);
    for (const AnyQueryOptions& options : all_tested_options()) {
      const std::uint32_t count = count_of(options);
      const auto all = random_case(options, count, 0.0);
      SCOPED_TRACE(testing::Message() << all->name() << ", " << entities << " entities");
      const std::vector<Words> answers = answers_of(*all);
      const auto with_others = random_case(options, count + 1, 0.5);
      with_others->copy_elements(*all, places_of(count));
      auto words = answers_of(*with_others);
      words.resize(answers.size());
      EXPECT_TRUE(have_equal_answers(words, answers));
    }
  }
}

}  // namespace
}  // namespace rtstdb::test
