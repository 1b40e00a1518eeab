#include "runtime/report/html/plot_script.hpp"
#include "runtime/report/html/sections.hpp"
#include "runtime/report/html/signal_plot.hpp"
#include "runtime/report/quantities.hpp"

namespace hil::report {
namespace {

void expectation_line(Markup& out, const Expectation& expectation) {
  const bool held = expectation.result == ExpectationResult::held;
  out.open("li").open("span", {{"class", held ? "tone good" : "tone bad"}});
  out.text((held ? "✓ " : "✗ ") + std::string(words_of(expectation.result))).close();
  out.text(" " + expectation.name);
  if (expectation.first_failure_ns) out.text(", first failed at " + instant(*expectation.first_failure_ns));
  out.close();
}

void plot_card(Markup& out, const RunRecord& record, const SignalPlot& plot) {
  out.open("figure", {{"class", "card"}});
  std::size_t expectations = 0;
  for (const std::uint32_t index : plot.expectations)
    expectations += index < record.expectations.size() ? 1 : 0;
  if (expectations == 0) {
    out.element("h3", plot.title);
  } else {
    out.open("ul", {{"class", "plain"}});
    for (const std::uint32_t index : plot.expectations)
      if (index < record.expectations.size()) expectation_line(out, record.expectations[index]);
    out.close();
  }
  draw_signal_plot(out, record, plot, PictureUse::inline_in_page);
  out.close();
}

void legend_entry(Markup& out, const char* css_class, const char* meaning, const char* path = "M0 6h12") {
  out.open("span").open("svg", {{"viewBox", "0 0 12 12"}, {"aria-hidden", "true"}});
  out.leaf("path", {{"class", css_class}, {"d", path}}).close();
  out.text(meaning).close();
}

}  // namespace

void signals_section(Markup& out, const RunRecord& record) {
  const SignalPlots& plots = record.signal_plots;
  if (plots.plots.empty() && plots.not_plotted.empty()) return;
  out.element("h2", "Signals");
  out.open("div", {{"class", "legend"}});
  legend_entry(out, "marker-failure", "first failure");
  legend_entry(out, "marker-least-margin", "least margin");
  legend_entry(out, "marker-met", "met");
  legend_entry(out, "limit", "limit of a condition");
  legend_entry(out, "expected", "expected by a test table, with its tolerance", "M6 6h0");
  legend_entry(out, "series c0 faulted", "with a fault");
  legend_entry(out, "series c0 reference", "reference");
  out.open("span", {{"class", "with-script"}})
      .text("Drag over a plot to zoom; double-click to reset.")
      .close();
  out.close();
  for (const SignalPlot& plot : plots.plots)
    plot_card(out, record, plot);
  if (!plots.not_plotted.empty()) {
    std::string names;
    for (const std::string& name : plots.not_plotted)
      names += (names.empty() ? "" : "; ") + name;
    out.element("p", {{"class", "small soft"}},
                "Without a plot, since those of expectations show " + std::to_string(max_expectation_series) +
                    " series at most: " + names + ". List their signals under plots to see them.");
  }
  out.open("script").raw(plot_script()).close();
}

}  // namespace hil::report
