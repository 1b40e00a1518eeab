#pragma once
// The one list of what report.json and world.json hold: every struct of the record, every key, in the order
// of the file. The writer and the reader both walk it, so they can not disagree. The records of buses in
// report.json and those of modules in world.json have keys of their own and are no part of the list.
//
// visit(key, member) is called once per member. Points are stored as compact rows (report_json.cpp).

#include "runtime/contribution/world_record.hpp"
#include "runtime/report/record_field.hpp"
#include "runtime/report/run_record.hpp"
#include "runtime/report/signal_plot_fields.hpp"

namespace hil::report {

template <Is<Scenario> T, class Visit>
void each_field(T& scenario, Visit&& visit) {
  visit("name", scenario.name);
  visit("file", scenario.file);
  visit("about", scenario.about);
}

template <Is<Override> T, class Visit>
void each_field(T& override_, Visit&& visit) {
  visit("path", override_.path);
  visit("value", override_.value);
}

template <Is<Realtime> T, class Visit>
void each_field(T& realtime, Visit&& visit) {
  visit("scheduler", realtime.scheduler);
  visit("priority", realtime.priority);
  visit("locked_memory", realtime.locked_memory);
  visit("cpus", realtime.cpus);
  visit("kernel", realtime.kernel);
  visit("degraded", realtime.degraded);
}

template <Is<Gpu> T, class Visit>
void each_field(T& gpu, Visit&& visit) {
  visit("device", gpu.device);
  visit("driver", gpu.driver);
  visit("api", gpu.api);
}

template <Is<Quantiles> T, class Visit>
void each_field(T& quantiles, Visit&& visit) {
  visit("samples", quantiles.samples);
  visit("p50", quantiles.p50);
  visit("p99", quantiles.p99);
  visit("p999", quantiles.p999);
  visit("max", quantiles.max);
}

template <Is<Slack> T, class Visit>
void each_field(T& slack, Visit&& visit) {
  visit("samples", slack.samples);
  visit("min", slack.min);
  visit("p50", slack.p50);
}

template <Is<TaskHistograms> T, class Visit>
void each_field(T& histograms, Visit&& visit) {
  visit("wake_latency_ns", histograms.wake_latency_ns);
  visit("wall_ns", histograms.wall_ns);
  visit("cpu_ns", histograms.cpu_ns);
  visit("blocked_ns", histograms.blocked_ns);
}

template <Is<Miss> T, class Visit>
void each_field(T& miss, Visit&& visit) {
  visit("tick", miss.tick);
  visit("cause", miss.cause);
  visit("lateness_ns", miss.lateness_ns);
}

template <Is<CauseCount> T, class Visit>
void each_field(T& counted, Visit&& visit) {
  visit("cause", counted.cause);
  visit("count", counted.count);
}

template <Is<Task> T, class Visit>
void each_field(T& task, Visit&& visit) {
  visit("name", task.name);
  visit("rate_hz", task.rate_hz);
  visit("thread", task.thread);
  visit("deadline_ns", task.deadline_ns);
  visit("budget_ns", task.budget_ns);
  visit("overrun_policy", task.overrun_policy);
  visit("runs", task.runs);
  visit("warmup_runs", task.warmup_runs);
  visit("deadline_misses", task.deadline_misses);
  visit("overruns", task.overruns);
  visit("skipped", task.skipped);
  visit("aborted", task.aborted);
  visit("over_budget", task.over_budget);
  visit("without_result", task.without_result);
  visit("discarded", task.discarded);
  visit("hard_misses", task.hard_misses);
  visit("warmup_problems", task.warmup_problems);
  visit("page_faults", task.page_faults);
  visit("wake_latency_ns", task.wake_latency_ns);
  visit("wall_ns", task.wall_ns);
  visit("cpu_ns", task.cpu_ns);
  visit("blocked_ns", task.blocked_ns);
  visit("gpu_ns", task.gpu_ns);
  visit("slack_ns", task.slack_ns);
  visit("misses_by_cause", task.misses_by_cause);
  visit("worst_lateness_ns", task.worst_lateness_ns);
  visit("misses", task.misses);
  visit("first_hard_misses", task.first_hard_misses);
  visit("worst_hard_miss", task.worst_hard_miss);
  visit("histograms", task.histograms);
}

template <Is<BaseStage> T, class Visit>
void each_field(T& stage, Visit&& visit) {
  visit("name", stage.name);
  visit("total_ns", stage.total_ns);
  visit("per_tick_ns", stage.per_tick_ns);
}

template <Is<Event> T, class Visit>
void each_field(T& event, Visit&& visit) {
  visit("time_ns", event.time_ns);
  visit("text", event.text);
}

template <Is<MissingTicks> T, class Visit>
void each_field(T& ticks, Visit&& visit) {
  visit("time_ns", ticks.time_ns);
  visit("text", ticks.text);
  visit("fault", ticks.fault);
}

template <Is<DatabaseLog> T, class Visit>
void each_field(T& log, Visit&& visit) {
  visit("durability", log.durability);
  visit("refused_transactions", log.refused_transactions);
  visit("latest_version", log.latest_version);
  visit("durable_version", log.durable_version);
  visit("bytes", log.bytes);
  visit("groups", log.groups);
  visit("segments", log.segments);
  visit("checkpoints", log.checkpoints);
  visit("longest_write_ns", log.longest_write_ns);
  visit("all_writes_ns", log.all_writes_ns);
  visit("ring_bytes", log.ring_bytes);
  visit("ring_high_water_bytes", log.ring_high_water_bytes);
  visit("gaps", log.gaps);
  visit("commits_in_gaps", log.commits_in_gaps);
  visit("faults", log.faults);
  visit("last_fault", log.last_fault);
}

template <Is<Transactions> T, class Visit>
void each_field(T& transactions, Visit&& visit) {
  visit("submitted", transactions.submitted);
  visit("committed", transactions.committed);
  visit("late", transactions.late);
  visit("missed", transactions.missed);
  visit("refused", transactions.refused);
  visit("conflicts", transactions.conflicts);
  visit("cancelled", transactions.cancelled);
  visit("truncated", transactions.truncated);
  visit("device_lost", transactions.device_lost);
  visit("bad_input", transactions.bad_input);
  visit("firm_late_commits", transactions.firm_late_commits);
  visit("hard_misses", transactions.hard_misses);
}

template <Is<CostPrediction> T, class Visit>
void each_field(T& prediction, Visit&& visit) {
  visit("cost_class", prediction.cost_class);
  visit("count", prediction.count);
  visit("p01", prediction.p01);
  visit("median", prediction.median);
  visit("p99", prediction.p99);
}

template <Is<Reservation> T, class Visit>
void each_field(T& reservation, Visit&& visit) {
  visit("name", reservation.name);
  visit("period_ns", reservation.period_ns);
  visit("deadline_ns", reservation.deadline_ns);
  visit("budget_ns", reservation.budget_ns);
  visit("transactions", reservation.transactions);
  visit("kept", reservation.kept);
  visit("broken", reservation.broken);
  visit("too_often", reservation.too_often);
  visit("too_long", reservation.too_long);
  visit("largest_cost_ns", reservation.largest_cost_ns);
  visit("longest_response_ns", reservation.longest_response_ns);
}

template <Is<Scheduler> T, class Visit>
void each_field(T& scheduler, Visit&& visit) {
  visit("promised", scheduler.promised);
  visit("kept", scheduler.kept);
  visit("outranked", scheduler.outranked);
  visit("restarts", scheduler.restarts);
  visit("predicted_over_actual", scheduler.predicted_over_actual);
  visit("reservations", scheduler.reservations);
  visit("not_reserved", scheduler.not_reserved);
}

template <Is<contribution::BusColumn> T, class Visit>
void each_field(T& column, Visit&& visit) {
  visit("key", column.key);
  visit("title", column.title);
  visit("is_fault", column.is_fault);
}

/// Without the records of the buses, which are a list of the file itself (bus_json.hpp).
template <Is<BusGroup> T, class Visit>
void each_field(T& group, Visit&& visit) {
  visit("list_key", group.list_key);
  visit("title", group.title);
  visit("name_key", group.name_key);
  visit("columns", group.columns);
}

template <Is<Process> T, class Visit>
void each_field(T& process, Visit&& visit) {
  visit("name", process.name);
  visit("command", process.command);
  visit("exit", process.exit);
  visit("ended_early_at_ns", process.ended_early_at_ns);
  visit("last_lines", process.last_lines);
}

template <Is<NotEvaluated> T, class Visit>
void each_field(T& interval, Visit&& visit) {
  visit("begin_ns", interval.begin_ns);
  visit("end_ns", interval.end_ns);
  visit("signals", interval.signals);
}

template <Is<LimitedFigure> T, class Visit>
void each_field(T& figure, Visit&& visit) {
  visit("name", figure.name);
  visit("value", figure.value);
  visit("unit", figure.unit);
  visit("min", figure.min);
  visit("max", figure.max);
  visit("held", figure.is_held);
}

template <Is<Expectation> T, class Visit>
void each_field(T& expectation, Visit&& visit) {
  visit("name", expectation.name);
  visit("result", expectation.result);
  if constexpr (std::is_const_v<T>) {  // for programs that need no more; the reader uses `result`
    const bool passed = expectation.result == ExpectationResult::held;
    visit("passed", passed);
  }
  visit("detail", expectation.detail);
  visit("first_failure_ns", expectation.first_failure_ns);
  visit("evaluated_ticks", expectation.evaluated_ticks);
  visit("covered_ticks", expectation.covered_ticks);
  visit("met_ns", expectation.met_ns);
  visit("margin", expectation.margin);
  visit("margin_unit", expectation.margin_unit);
  visit("worst_ns", expectation.worst_ns);
  visit("not_evaluated", expectation.not_evaluated);
  visit("figures", expectation.figures);
  visit("shift_ns", expectation.shift_ns);
}

template <Is<Loss> T, class Visit>
void each_field(T& loss, Visit&& visit) {
  visit("what", loss.what);
  visit("begin_ns", loss.begin_ns);
  visit("duration_ns", loss.duration_ns);
  visit("to_the_end", loss.to_the_end);
  visit("permitted", loss.permitted);
  visit("fault", loss.fault);
  visit("cause", loss.cause);
}

template <Is<ResponseTime> T, class Visit>
void each_field(T& response, Visit&& visit) {
  visit("name", response.name);
  visit("limit_ns", response.limit_ns);
  visit("samples_ns", response.samples_ns);
  visit("unanswered", response.unanswered);
  visit("not_judged", response.not_judged);
}

template <Is<Shape> T, class Visit>
void each_field(T& shape, Visit&& visit) {
  visit("drawn_as", shape.layer);
  visit("layer", shape.body_layer);
  visit("label", shape.label);
  visit("footprint", shape.footprint);
}

template <Is<Track> T, class Visit>
void each_field(T& track, Visit&& visit) {
  visit("name", track.name);
  visit("ego", track.ego);
  visit("points", track.points);
}

template <Is<FieldOfView> T, class Visit>
void each_field(T& fan, Visit&& visit) {
  visit("origin", fan.origin);
  visit("first_direction_rad", fan.first_direction_rad);
  visit("last_direction_rad", fan.last_direction_rad);
  visit("range_m", fan.range_m);
}

template <Is<ViewBox> T, class Visit>
void each_field(T& box, Visit&& visit) {
  visit("minimum", box.minimum);
  visit("maximum", box.maximum);
}

template <Is<TopView> T, class Visit>
void each_field(T& view, Visit&& visit) {
  visit("time_ns", view.time_ns);
  visit("view", view.view);
  visit("shapes", view.shapes);
  visit("tracks", view.tracks);
  visit("fan", view.fan);
  visit("scan_points", view.scan_points);
}

template <Is<contribution::Dimension> T, class Visit>
void each_field(T& dimension, Visit&& visit) {
  visit("name", dimension.name);
  visit("length_m", dimension.length_m);
}

template <Is<Picture> T, class Visit>
void each_field(T& picture, Visit&& visit) {
  visit("title", picture.title);
  visit("caption", picture.caption);
  visit("entities", picture.entities);
  visit("subject", picture.subject);
  visit("right", picture.right);
  visit("outline_length_m", picture.outline_length_m);
  visit("dimensions", picture.dimensions);
  visit("points", picture.points);
}

template <Is<contribution::PlotAxis> T, class Visit>
void each_field(T& axis, Visit&& visit) {
  visit("quantity", axis.quantity);
  visit("unit", axis.unit);
  visit("logarithmic", axis.logarithmic);
}

template <Is<contribution::Series> T, class Visit>
void each_field(T& series, Visit&& visit) {
  visit("name", series.name);
  visit("points", series.points);
}

template <Is<contribution::Plot> T, class Visit>
void each_field(T& plot, Visit&& visit) {
  visit("title", plot.title);
  visit("caption", plot.caption);
  visit("x", plot.x);
  visit("y", plot.y);
  visit("series", plot.series);
  visit("bars", plot.bars);
}

template <Is<contribution::Column> T, class Visit>
void each_field(T& column, Visit&& visit) {
  visit("title", column.title);
  visit("numeric", column.numeric);
  visit("unit", column.unit);
  visit("decimals", column.decimals);
}

template <Is<contribution::Cell> T, class Visit>
void each_field(T& cell, Visit&& visit) {
  visit("text", cell.text);
  visit("number", cell.number);
  visit("mark", cell.mark);
}

template <Is<contribution::Table> T, class Visit>
void each_field(T& table, Visit&& visit) {
  visit("columns", table.columns);
  visit("rows", table.rows);
}

template <Is<contribution::ShownImage> T, class Visit>
void each_field(T& image, Visit&& visit) {
  visit("title", image.title);
  visit("caption", image.caption);
  visit("png", image.png);
}

template <Is<Section> T, class Visit>
void each_field(T& section, Visit&& visit) {
  visit("name", section.name);
  visit("title", section.title);
  visit("text", section.text);
  visit("images", section.images);
  visit("pictures", section.pictures);
  visit("plots", section.plots);
  visit("tables", section.tables);
}

template <Is<Injection> T, class Visit>
void each_field(T& injection, Visit&& visit) {
  visit("name", injection.name);
  visit("target", injection.target);
  visit("effect", injection.effect);
  visit("begins", injection.begins);
  visit("first_begin_ns", injection.first_begin_ns);
  visit("active_ns", injection.active_ns);
  visit("spans", injection.spans);
  visit("frames", injection.frames);
  visit("took_effect", injection.took_effect);
  visit("missing_effect", injection.missing_effect);
  visit("test_table", injection.test_table);
}

template <Is<View> T, class Visit>
void each_field(T& view, Visit&& visit) {
  visit("name", view.name);
  visit("time_ns", view.time_ns);
  visit("exposure_value", view.exposure_value);
  visit("in_daylight", view.in_daylight);
  visit("lights_overflow", view.lights_overflow);
  visit("incomplete_pixels", view.incomplete_pixels);
  visit("file", view.file);
  visit("image_png", view.image_png);
}

template <Is<Recording> T, class Visit>
void each_field(T& recording, Visit&& visit) {
  visit("file", recording.file);
  visit("bytes", recording.bytes);
  visit("messages", recording.messages);
  visit("dropped", recording.dropped);
  visit("stopped_at_ns", recording.stopped_at_ns);
  visit("not_recorded", recording.not_recorded);
}

template <Is<plugins::PluginIdentity> T, class Visit>
void each_field(T& plugin, Visit&& visit) {
  visit("name", plugin.name);
  visit("version", plugin.version);
  visit("path", plugin.path);
  visit("hash", plugin.hash);
}

template <Is<RunRecord> T, class Visit>
void each_field(T& record, Visit&& visit) {
  visit("scenario", record.scenario);
  visit("verdict", record.verdict);
  visit("reason", record.reason);
  visit("exit_code", record.exit_code);
  visit("program_version", record.program_version);
  visit("plugins", record.plugins);
  visit("clock", record.clock);
  visit("ticks", record.ticks);
  visit("skipped_ticks", record.skipped_ticks);
  visit("run_time_ns", record.run_time_ns);
  visit("period_ns", record.period_ns);
  visit("duration_ns", record.duration_ns);
  visit("started_at", record.started_at);
  visit("wall_ns", record.wall_ns);
  visit("seed", record.seed);
  visit("overrides", record.overrides);
  visit("realtime", record.realtime);
  visit("gpu", record.gpu);
  visit("stimuli", record.stimuli);
  visit("faults", record.faults);
  visit("expectations", record.expectations);
  visit("losses", record.losses);
  visit("losses_not_listed", record.losses_not_listed);
  visit("failures", record.failures);
  visit("input_failures", record.input_failures);
  visit("tasks", record.tasks);
  visit("base_stages", record.base_stages);
  visit("watchdog", record.watchdog);
  visit("watchdog_not_listed", record.watchdog_not_listed);
  visit("transactions", record.transactions);
  visit("scheduler", record.scheduler);
  visit("database_log", record.database_log);
  visit("buses", record.buses);
  visit("processes", record.processes);
  visit("response_times", record.response_times);
  visit("events", record.events);
  visit("events_not_listed", record.events_not_listed);
  visit("top_view", record.top_view);
  visit("sections", record.sections);
  visit("views", record.views);
  visit("recording", record.recording);
  visit("signal_plots", record.signal_plots);
}

template <Is<contribution::NamedEntity> T, class Visit>
void each_field(T& entity, Visit&& visit) {
  visit("name", entity.name);
  visit("index", entity.index);
  visit("generation", entity.generation);
}

template <Is<contribution::FieldRecord> T, class Visit>
void each_field(T& field, Visit&& visit) {
  visit("geometry", field.geometry);
  visit("error_m", field.error_m);
  visit("cell_m", field.cell_m);
  visit("sign", field.sign);
  visit("max_bytes", field.max_bytes);
}

template <Is<contribution::WorldRecord> T, class Visit>
void each_field(T& world, Visit&& visit) {
  visit("scenario", world.scenario);
  visit("database_id", world.database_id);
  visit("period_ns", world.period_ns);
  visit("plugins", world.plugins);
  visit("layers", world.layers);
  visit("entities", world.entities);
  visit("fields", world.fields);
}

}  // namespace hil::report
