#pragma once
// Reads the options of `hil history`. All functions throw HistoryError (question) with a sentence for the
// user that names the option.
//
// Threads: any; check_outside reads the file system.

#include <glm/ext/vector_float3.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <hil/quantity.hpp>

namespace hil::cli {

[[noreturn]] void refuse(const std::string& sentence);

config::QuantityReading read_option(const char* option, const std::string& text, config::Quantity quantity);
std::int64_t read_time_ns(const char* option, const std::string& text);
/// A distance in metres: at least 0, at most the size of a world.
double read_distance_m(const char* option, const std::string& text);

/// Refuses a file in the folder of the run, in which a history changes nothing.
void check_outside(const char* option, const std::string& file, const std::string& directory);

/// The numbers of an option; empty when it was not given.
void check_numbers(const char* option, const std::vector<double>& numbers);
/// The numbers from index `first` on are sizes.
void check_sizes(const char* option, const std::vector<double>& numbers, std::size_t first);
/// Three numbers from index `first` on.
glm::vec3 three_of(const std::vector<double>& numbers, std::size_t first = 0);

}  // namespace hil::cli
