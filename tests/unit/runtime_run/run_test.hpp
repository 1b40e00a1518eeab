#pragma once
// The folder of a test of runtime/run.

#include "tests/support/test_folder.hpp"

namespace hil::run::testing {

using Folder = tests::TestFolder;

}  // namespace hil::run::testing
