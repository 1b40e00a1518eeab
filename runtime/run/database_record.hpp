#pragma once
// Converts the counts of the database into the report's record.

#include <rtstdb/database.hpp>

#include "runtime/report/run_record.hpp"

namespace hil::run {

report::Transactions transactions_of(const rtstdb::TransactionCounts& counts);
report::Scheduler scheduler_of(const rtstdb::SchedulerCounts& counts);
report::DatabaseLog database_log_of(const rtstdb::Durability& durability, rtstdb::Version latest,
                                    const rtstdb::TransactionCounts& counts);

}  // namespace hil::run
