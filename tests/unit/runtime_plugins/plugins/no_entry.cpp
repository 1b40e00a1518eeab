// A note of a plug-in without the function that hil calls.

#include <hil/plugin.hpp>

__attribute__((section(".note.hil"), used, aligned(4))) static constexpr hil::plugins::Note note{
    "abi=" HIL_ABI "\nname=no_entry\nversion=1\n"};
