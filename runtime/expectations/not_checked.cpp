#include "runtime/expectations/not_checked.hpp"

namespace hil::expectations {
namespace {

class NotCheckedJudge final : public Judge {
 public:
  NotCheckedJudge(const NotChecked& claim, const JudgeContext& context)
      : name_(context.expectation.name), reason_(claim.reason) {}
  void check(const signals::SignalTable& /*table*/, std::span<const Arrival> /*arrived*/,
             std::int64_t /*time_ns*/) noexcept override {}
  void skip(const signals::SignalTable& /*table*/, std::span<const Arrival> /*arrived*/,
            std::int64_t /*time_ns*/) noexcept override {}
  report::Expectation result(const Extent& /*extent*/) const override {
    return {.name = name_, .result = report::ExpectationResult::not_checked, .detail = reason_};
  }

 private:
  const std::string name_, reason_;
};

}  // namespace

void check_claim(const NotChecked& /*claim*/, const ClaimCheck& /*check*/) {}

std::unique_ptr<Judge> judge_of(const NotChecked& claim, const JudgeContext& context) {
  return std::make_unique<NotCheckedJudge>(claim, context);
}

PlotContent plot_content_of(const NotChecked& /*claim*/, const signals::SignalTable& /*table*/) {
  return {};
}

}  // namespace hil::expectations
