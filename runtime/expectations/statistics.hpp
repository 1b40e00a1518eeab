#pragma once
// statistics: limits of figures of a signal. mean, rms and standard_deviation are those of its ticks, the
// others those of its instants.
//
// mean, rms, standard_deviation  of the values of all ticks, each with the same weight (Welford's method);
//                     the standard deviation has the divisor n.
// smallest, largest   of the values.
// overshoot           the largest excess over the final value `of`, away from `from`, as a share of the step
//                     from `from` to `of` (Ogata: maximum percent overshoot).
// settling_time       from the first judged instant to the first one from which on the signal stays within
//                     the share `within` of the step around `of` (Ogata: settling time).
//
// `from` is the value at the first judged instant when it is left out. A signal that was never within 10 % of
// the step of `from` made no step, and one that did not reach 90 % of it after that can not overshoot; the
// expectation is not checked then.
//
// The margin is that of the limit whose distance is the smallest share of the limit itself, in its unit.

#include <array>
#include <cstdint>
#include <memory>
#include <optional>

#include "runtime/expectations/judge.hpp"

namespace hil::expectations {

struct Limits {
  std::optional<config::Expression> min, max;
};
struct StepResponse {
  config::Expression of;
  std::optional<config::Expression> from;
};

struct Statistics {
  enum Figure : std::uint8_t { mean, rms, standard_deviation, smallest, largest };
  struct Overshoot {
    StepResponse step;
    double at_most = 0.0;  ///< share of the step
  };
  struct Settling {
    StepResponse step;
    double within = 0.0;  ///< share of the step
    std::int64_t at_most_ns = 0;
  };

  config::Word signal;
  std::array<Limits, 5> limits;  ///< by Figure
  std::optional<Overshoot> overshoot;
  std::optional<Settling> settling;
};

/// "standard_deviation", the key of the figure.
const char* key_of(Statistics::Figure figure);
/// False: a temperature in degC or degF, whose squares depend on where the scale begins.
bool has_rms(const signals::SignalInfo& signal);

void check_claim(const Statistics& claim, const ClaimCheck& check);
std::vector<signals::SignalId> judged_arrivals_of(const Statistics& claim, const signals::SignalTable& table);
std::unique_ptr<Judge> judge_of(const Statistics& claim, const JudgeContext& context);
PlotContent plot_content_of(const Statistics& claim, const signals::SignalTable& table);

config::ExpectationKind statistics_kind();

}  // namespace hil::expectations
