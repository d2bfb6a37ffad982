#pragma once

#include <urdf_model/model.h>

#include <filesystem>
#include <string>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/geometry/fit/cover.hpp"
#include "steadyhand/geometry/fit/fit.hpp"
#include "steadyhand/geometry/robot/urdf_chain.hpp"
#include "steadyhand/geometry/robot/urdf_file.hpp"

namespace steadyhand {

/// The geometry of one URDF link, in its frame.
struct LinkGeometry {
  std::string source;
  std::vector<Surface> pieces;
  std::vector<FittedSolid> exact;  ///< the same as solids, if all of it are spheres and boxes
};

/// Reads that of links: their collision geometry, what settings name instead, or the visual one.
class LinkReader {
 public:
  /// @param folder of the URDF, from which its meshes are found. The settings must outlive it.
  LinkReader(const FitSettings& settings, std::filesystem::path folder)
      : settings_(settings), folder_(std::move(folder)) {}

  /// Fails on files that cannot be read and on sizes that are none, with the link and the reason.
  Result<LinkGeometry> read(const urdf::Link& link);

 private:
  Result<LinkGeometry> read_files(const urdf::Link& link, const std::vector<std::filesystem::path>& files);
  Status add_element(const std::string& link, const char* use, const urdf::Geometry& shape,
                     const Eigen::Isometry3d& origin, LinkGeometry& geometry, bool& whole);

  const FitSettings& settings_;
  std::filesystem::path folder_;
};

/// Refuses what would leave part of a link without a body: a <visual> that cannot be read and is to be covered.
Status check_unread(const urdf::ModelInterface& urdf, const std::vector<UnreadElement>& unread,
                    const FitSettings& settings);

/// Refuses a link that is far longer than the arm, or, if the arm does not move it, than a hall: its mesh is in mm.
Status check_size(const FitSettings& settings, const urdf::Link& link, const LinkGeometry& geometry,
                  const UrdfChain& chain);

/// The URDF's links with geometry, in groups that are covered together: the first holds the others. Of very many, those
/// that move elsewhere are left out.
std::vector<std::vector<const urdf::Link*>> group_links(const urdf::ModelInterface& urdf, const UrdfChain& chain,
                                                        const FitSettings& settings,
                                                        std::vector<std::string>& left_out);

}  // namespace steadyhand
