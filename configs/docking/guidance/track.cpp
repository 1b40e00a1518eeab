#include "configs/docking/guidance/track.hpp"

#include <algorithm>
#include <cmath>

namespace hil::docking::guidance {

namespace {

/// Power spectral density of accelerations that are not commanded: errors of the thrusters, the orbit.
constexpr double noise_m2ps3 = 4e-6;

}  // namespace

void Track::begin(const glm::dvec3& p_m, double sigma_m, double sigma_mps) {
  for (int i = 0; i < 3; ++i) {
    axes_[static_cast<std::size_t>(i)] = {
        .p = p_m[i], .v = 0.0, .pp = sigma_m * sigma_m, .pv = 0.0, .vv = sigma_mps * sigma_mps};
  }
}

void Track::predict(double dt_s, const glm::dvec3& a_mps2) {
  for (int i = 0; i < 3; ++i) {
    Axis& axis = axes_[static_cast<std::size_t>(i)];
    axis.p += axis.v * dt_s + 0.5 * a_mps2[i] * dt_s * dt_s;
    axis.v += a_mps2[i] * dt_s;
    axis.pp += 2.0 * dt_s * axis.pv + dt_s * dt_s * axis.vv + noise_m2ps3 * dt_s * dt_s * dt_s / 3.0;
    axis.pv += dt_s * axis.vv + 0.5 * noise_m2ps3 * dt_s * dt_s;
    axis.vv += noise_m2ps3 * dt_s;
  }
}

void Track::update(const glm::dvec3& p_m, double sigma_m, double age_s) {
  for (int i = 0; i < 3; ++i) {
    Axis& axis = axes_[static_cast<std::size_t>(i)];
    // The measured position is that of an earlier instant: z = p - v age.
    const double innovation = p_m[i] - (axis.p - axis.v * age_s);
    const double hp = axis.pp - age_s * axis.pv;  // of the position, with the measurement
    const double hv = axis.pv - age_s * axis.vv;  // of the velocity
    const double variance = hp - age_s * hv + sigma_m * sigma_m;
    const double gain_p = hp / variance, gain_v = hv / variance;
    axis.p += gain_p * innovation;
    axis.v += gain_v * innovation;
    axis.pp -= gain_p * hp;
    axis.pv -= gain_p * hv;
    axis.vv -= gain_v * hv;
  }
}

glm::dvec3 Track::p_m() const {
  return {axes_[0].p, axes_[1].p, axes_[2].p};
}

glm::dvec3 Track::v_mps() const {
  return {axes_[0].v, axes_[1].v, axes_[2].v};
}

double Track::sigma_m() const {
  return std::sqrt(std::max({axes_[0].pp, axes_[1].pp, axes_[2].pp}));
}

}  // namespace hil::docking::guidance
