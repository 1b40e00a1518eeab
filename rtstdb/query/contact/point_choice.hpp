#pragma once
// Chooses up to four points of a pair of bodies among the points that the caller offers: the deepest, the one
// farthest from it, and the two that span the most area with these, one on each side. The points are offered
// again in each step.
//
// Pure; no allocation.

#include <glm/ext/vector_float3.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <limits>
#include <span>

namespace rtstdb::query {

class PointChoice {
 public:
  /// Identifies a point.
  struct Number {
    std::uint32_t place = 0, k = 0;
  };
  enum class Step : std::uint8_t { deepest, farthest, left, right, done };

  /// `n`: the normal of the pair. Depths that differ by less than `tie_m` are equal; the first point counts.
  PointChoice(const glm::vec3& n, float tie_m) noexcept : n_(n), tie_m_(tie_m) {}

  Step begin() noexcept { return step_ = Step::deepest; }
  /// Ends a step in which all points were offered.
  Step next() noexcept {
    if (has_best_) {
      chosen_[count_] = best_;
      at_m_[count_++] = best_at_m_;
    }
    // Without a first point, or a second one apart from it, there are no others.
    const bool goes_on = has_best_ || step_ == Step::left;
    has_best_ = false;
    best_score_ = 0.0f;
    step_ = goes_on ? static_cast<Step>(static_cast<std::uint8_t>(step_) + 1) : Step::done;
    return step_;
  }
  void offer(const Number& number, const glm::vec3& at_m, float depth_m) noexcept {
    const float score = score_of(at_m, depth_m);
    if (step_ == Step::deepest ? has_best_ && score <= best_score_ + tie_m_ : score <= best_score_) return;
    best_ = number;
    best_at_m_ = at_m;
    best_score_ = score;
    has_best_ = true;
  }
  std::span<const Number> chosen() const noexcept { return {chosen_.data(), count_}; }

 private:
  /// Above 0: the point is chosen, unless another one has more.
  float score_of(const glm::vec3& at_m, float depth_m) const noexcept {
    if (step_ == Step::deepest) return depth_m;
    if (step_ == Step::farthest) return glm::dot(at_m - at_m_[0], at_m - at_m_[0]);
    const float area = glm::dot(glm::cross(at_m_[1] - at_m_[0], at_m - at_m_[0]), n_);
    return step_ == Step::left ? area : -area;
  }

  glm::vec3 n_;
  float tie_m_;
  Step step_ = Step::deepest;
  std::array<Number, 4> chosen_{};
  std::array<glm::vec3, 4> at_m_{};
  std::uint32_t count_ = 0;
  Number best_;
  glm::vec3 best_at_m_{0.0f};
  float best_score_ = 0.0f;
  bool has_best_ = false;
};

}  // namespace rtstdb::query
