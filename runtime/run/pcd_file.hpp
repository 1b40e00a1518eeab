#pragma once
// Point clouds as PCD files, version 0.7, binary: the format of the Point Cloud Library, which its viewer,
// CloudCompare, Open3D and others read. Fields, in this order: x y z (m, sensor frame), intensity (1/m^2),
// fraction, column, row, return, entity, material, time (s of run time). VIEWPOINT is the pose of the sensor
// in the world at the begin of the sweep.
//
// Source: https://pointclouds.org/documentation/tutorials/pcd_file_format.html
// Threads: any; writes files and allocates.

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "runtime/modules/point_cloud.hpp"

namespace hil::run {

/// The header of a cloud, up to its first point.
std::string pcd_header(std::size_t points, const rtstdb::Pose& sensor);

/// Writes a file. Returns an empty text, or why the file could not be written.
std::string write_pcd(const std::filesystem::path& file, std::span<const modules::CloudPoint> points,
                      const rtstdb::Pose& sensor);

}  // namespace hil::run
