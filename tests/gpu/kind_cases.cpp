#include "tests/gpu/kind_cases.hpp"

#include <algorithm>
#include <utility>
#include <variant>

namespace rtstdb::test {
namespace {

// ---- ray

std::vector<RayQueryOptions> tested_options(const RayQuery* /*kind*/) {
  return {{.name = "closest"},
          {.name = "any", .mode = RayMode::any},
          {.name = "first", .mode = RayMode::first, .hits_per_ray = 3},
          {.name = "still", .ignore_motion = true}};
}

Ray random_element(Random& random, const ElementScene& scene, const Ray* /*type*/) {
  return random_ray(random, scene.entities, scene.scene, scene.first, scene.window_s);
}

// ---- region and overlap

std::vector<RegionQueryOptions> tested_options(const RegionQuery* /*kind*/) {
  std::vector<RegionQueryOptions> all;
  for (const RegionLevel level : {RegionLevel::bounds, RegionLevel::surface, RegionLevel::triangle}) {
    // Short lists overflow, so that the search for the lowest ids runs.
    all.push_back({.name = std::string("lists by ") + to_string(level), .level = level, .ids_per_region = 8});
    all.push_back(
        {.name = std::string("counts by ") + to_string(level), .level = level, .ids_per_region = 0});
  }
  return all;
}

Region random_element(Random& random, const ElementScene& scene, const Region* /*type*/) {
  return random_region(random, scene.entities, scene.scene, scene.first, scene.window_s);
}

std::vector<OverlapQueryOptions> tested_options(const OverlapQuery* /*kind*/) {
  return {{.name = "overlaps", .ids_per_entity = 8}, {.name = "overlap counts", .ids_per_entity = 0}};
}

Overlap random_element(Random& random, const ElementScene& scene, const Overlap* /*type*/) {
  Overlap overlap;
  const EntityState* state = nullptr;
  while (state == nullptr || !state->row.geometry.valid())
    state = &scene.entities[random.below(scene.entities.size())];
  overlap.entity = state->id;
  overlap.t =
      scene.first + Nanoseconds(static_cast<std::int64_t>(random.uniform(0.0, 1.0) * scene.window_s * 1e9));
  if (random.one_in(3)) overlap.mask = static_cast<std::uint32_t>(random.below(16));
  return overlap;
}

// ---- nearest

std::vector<NearestQueryOptions> tested_options(const NearestQuery* /*kind*/) {
  return {{.name = "signed", .target = NearestTarget::surface, .k = 3, .is_signed = true},
          {.name = "centers", .target = NearestTarget::center, .k = 4},
          {.name = "bounds", .target = NearestTarget::bounds, .k = 9},
          {.name = "nearest triangle", .target = NearestTarget::triangle},
          {.name = "triangles", .target = NearestTarget::triangle, .k = 5}};
}

Nearest random_element(Random& random, const ElementScene& scene, const Nearest* /*type*/) {
  return random_point(random, scene.entities, scene.scene, scene.first, scene.window_s);
}

// ---- cone

std::vector<ConeQueryOptions> tested_options(const ConeQuery* /*kind*/) {
  return {{.name = "cone"},
          {.name = "cone returns", .returns_per_cone = 3},
          {.name = "cone fronts", .returns_per_cone = 2, .faces = Faces::front},
          {.name = "cone fractions", .returns_per_cone = 2, .fractions = true},
          {.name = "cone fast", .returns_per_cone = 2, .mode = ConeMode::fast}};
}

Cone random_element(Random& random, const ElementScene& scene, const Cone* /*type*/) {
  return random_cone(random, scene.entities, scene.scene, scene.first, scene.window_s);
}

// ---- contact

std::vector<ContactQueryOptions> tested_options(const ContactQuery* /*kind*/) {
  ContactQueryOptions options{.name = "contacts",
                              .pairs_per_search = 64,
                              .max_candidates = 65536,
                              .max_bodies = 65536,
                              .max_surface_pairs = 4096,
                              .max_surface_triangles = 1u << 17};
  ContactQueryOptions few = options;
  few.name = "few contacts";
  few.pairs_per_search = 2;
  return {options, few};
}

ContactSearch random_element(Random& random, const ElementScene& scene, const ContactSearch* /*type*/) {
  return random_contact_search(random, scene.entities, scene.first, scene.window_s);
}

// ---- impact

std::vector<ImpactQueryOptions> tested_options(const ImpactQuery* /*kind*/) {
  return {{.name = "impacts", .candidates_per_search = 32}};
}

ImpactSearch random_element(Random& random, const ElementScene& scene, const ImpactSearch* /*type*/) {
  return random_impact_search(random, scene.entities, scene.first, scene.window_s);
}

// ---- image

std::vector<ImageQueryOptions> tested_options(const ImageQuery* /*kind*/) {
  const ImageOutputs all{
      .color = true, .srgb = true, .depth = true, .identity = true, .normal = true, .motion = true};
  return {{.name = "images", .width = 4, .height = 3, .outputs = all, .samples_per_pixel = 2, .bounces = 1},
          {.name = "rasterised images",
           .width = 4,
           .height = 4,
           .mode = ImageMode::real_time,
           .outputs = all,
           .first_hits = FirstHits::rasterised,
           .samples_per_pixel = 1,
           .bounces = 2,
           .emitter_points = 2,
           .lobe_rays = 2}};
}

Camera random_element(Random& random, const ElementScene& scene, const Camera* /*type*/) {
  return random_camera(random, scene.entities, scene.scene, scene.first, scene.window_s);
}

/// What the options of a query do not allow is taken out of a random element.
template <class Element, class Options>
void allow(Element& /*element*/, const Options& /*options*/) {}

void allow(Camera& camera, const ImageQueryOptions& options) {
  if (options.first_hits == FirstHits::rasterised) camera.row_time = {};
}

// ---- every kind

template <class Class>
struct KindOf;
#define QUERY_KIND(kind, Class, Element_, elements_, Answer_, answers_, ...)                \
  template <>                                                                               \
  struct KindOf<Class> {                                                                    \
    using Options = Class##Options;                                                         \
    using Element = Element_;                                                               \
    using Answer = Answer_;                                                                 \
    static constexpr std::string_view name = #kind;                                         \
    static std::span<Element> elements(Class& query) { return query.elements_(); }          \
    static std::span<const Answer> answers(const Class& query) { return query.answers_(); } \
  };
#include <rtstdb/query_kinds.def>
#undef QUERY_KIND

template <class Class>
constexpr bool answers_whole_batches = false;
template <>
constexpr bool answers_whole_batches<ContactQuery> = true;
template <>
constexpr bool answers_whole_batches<ImpactQuery> = true;

template <class Class>
class CaseOf final : public KindCase {
  using Kind = KindOf<Class>;

 public:
  CaseOf(typename Kind::Options options, std::unique_ptr<Class> query)
      : KindCase(options.name), options_(std::move(options)), query_(std::move(query)) {}

  Query& query() noexcept override { return *query_; }
  bool is_answered_whole() const noexcept override { return answers_whole_batches<Class>; }
  void fill(Random& random, const ElementScene& scene) override {
    for (auto& element : Kind::elements(*query_)) {
      element = random_element(random, scene, static_cast<const typename Kind::Element*>(nullptr));
      allow(element, options_);
    }
  }
  void copy_elements(KindCase& from, std::span<const std::uint32_t> places, std::uint32_t first) override {
    const auto source = Kind::elements(*dynamic_cast<CaseOf&>(from).query_);
    const auto target = Kind::elements(*query_).subspan(first);
    for (std::size_t i = 0; i < places.size(); ++i)
      target[i] = source[places[i]];
  }
  std::vector<Words> words() const override { return words_of(Kind::answers(*query_)); }
  Tally judge(const oracle::World& world, bool skip_incomplete) override {
    const std::uint32_t count = query_->answer_info().elements;
    const auto all_answers = Kind::answers(*query_);
    const auto all_words = words();
    const std::size_t per_element = count == 0 ? 0 : all_answers.size() / count;
    std::vector<typename Kind::Element> elements;
    std::vector<typename Kind::Answer> answers;
    for (std::size_t i = 0; i < count; ++i) {
      if (skip_incomplete && is_incomplete(all_words[i * per_element])) continue;
      elements.push_back(Kind::elements(*query_)[i]);
      for (std::size_t k = 0; k < per_element; ++k)
        answers.push_back(all_answers[i * per_element + k]);
    }
    return test::judge(world, std::span<const typename Kind::Element>(elements),
                       std::span<const typename Kind::Answer>(answers), options_);
  }

 private:
  typename Kind::Options options_;
  std::unique_ptr<Class> query_;
};

/// `prepare` returns a Result with the query for options of any kind.
template <class Prepare>
Result<std::unique_ptr<KindCase>> make_case(const AnyQueryOptions& any_options, Prepare prepare) {
  return std::visit(
      [&](const auto& options) -> Result<std::unique_ptr<KindCase>> {
        using Class = typename std::remove_cvref_t<decltype(options)>::Prepared;
        auto query = prepare(options);
        if (!query) return query.error();
        return std::unique_ptr<KindCase>(std::make_unique<CaseOf<Class>>(options, std::move(query).value()));
      },
      any_options);
}

std::unique_ptr<KindCase> expect_made(Result<std::unique_ptr<KindCase>> made) {
  if (made) return std::move(made).value();
  ADD_FAILURE() << made.error().message;
  return nullptr;
}

}  // namespace

std::vector<AnyQueryOptions> all_tested_options() {
  std::vector<AnyQueryOptions> all;
#define QUERY_KIND(kind, Class, Element, elements, Answer, answers, ...)         \
  for (const auto& options : tested_options(static_cast<const Class*>(nullptr))) \
    all.emplace_back(options);
#include <rtstdb/query_kinds.def>
#undef QUERY_KIND
  return all;
}

std::vector<AnyQueryOptions> one_option_per_kind() {
  std::vector<AnyQueryOptions> all;
#define QUERY_KIND(kind, Class, Element, elements, Answer, answers, ...) \
  all.emplace_back(tested_options(static_cast<const Class*>(nullptr)).front());
#include <rtstdb/query_kinds.def>
#undef QUERY_KIND
  return all;
}

bool is_expensive(const AnyQueryOptions& options) {
  const auto* cones = std::get_if<ConeQueryOptions>(&options);
  return (cones != nullptr && cones->fractions) || std::holds_alternative<ContactQueryOptions>(options) ||
         std::holds_alternative<ImpactQueryOptions>(options) ||
         std::holds_alternative<ImageQueryOptions>(options);
}

AnyQueryOptions with(AnyQueryOptions options, std::uint32_t capacity, LatePolicy late) {
  std::visit(
      [&](auto& of_kind) {
        of_kind.capacity = capacity;
        of_kind.late = late;
      },
      options);
  return options;
}

std::string_view kind_name(const AnyQueryOptions& options) {
  return std::visit(
      [](const auto& of_kind) {
        return KindOf<typename std::remove_cvref_t<decltype(of_kind)>::Prepared>::name;
      },
      options);
}

Result<std::unique_ptr<KindCase>> try_to_prepare_case(Database& database, const AnyQueryOptions& options) {
  return make_case(options, [&](const auto& of_kind) { return database.prepare(of_kind); });
}

std::unique_ptr<KindCase> prepare_case(Database& database, const AnyQueryOptions& options) {
  return expect_made(try_to_prepare_case(database, options));
}

std::unique_ptr<KindCase> prepare_case(query::GpuExecutor& executor, const AnyQueryOptions& options) {
  return expect_made(make_case(options, [&](const auto& of_kind) {
    using Class = typename std::remove_cvref_t<decltype(of_kind)>::Prepared;
    auto made = executor.prepare(&of_kind);
    if (!made) return Result<std::unique_ptr<Class>>(made.error());
    return Result<std::unique_ptr<Class>>(
        std::unique_ptr<Class>(dynamic_cast<Class*>(made.value().release())));
  }));
}

}  // namespace rtstdb::test
