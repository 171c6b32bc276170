// Pinocchio as a peer: the frame of the tip and its Jacobian, in batches.
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/multibody.hpp>
#include <pinocchio/parsers/urdf.hpp>

#include <cstddef>
#include <cstring>
#include <exception>
#include <iostream>

namespace {

struct Peer {
  pinocchio::Model model;
  pinocchio::Data data;
  pinocchio::FrameIndex tip;
  pinocchio::Data::Matrix6x jacobian;
  Eigen::VectorXd q;

  Peer(const pinocchio::Model& read, const char* tip_name)
      : model(read),
        data(model),
        tip(model.getFrameId(tip_name)),
        jacobian(pinocchio::Data::Matrix6x::Zero(6, model.nv)),
        q(Eigen::VectorXd::Zero(model.nq)) {}

  void solve(const double* at) {
    std::memcpy(q.data(), at, sizeof(double) * static_cast<std::size_t>(model.nq));
    pinocchio::computeFrameJacobian(model, data, q, tip, pinocchio::LOCAL_WORLD_ALIGNED, jacobian);
    pinocchio::updateFramePlacement(model, data, tip);
  }
};

}  // namespace

// The model of a URDF file; null, with the reason on standard error, where it cannot be read or
// has not `joints` coordinates or no such tip.
extern "C" void* peer_open(const char* urdf, const char* tip, std::size_t joints) try {
  pinocchio::Model model;
  pinocchio::urdf::buildModel(urdf, model);
  if (!model.existFrame(tip) || static_cast<std::size_t>(model.nq) != joints) {
    std::cerr << urdf << ": no frame " << tip << " behind " << joints << " joints\n";
    return nullptr;
  }
  return new Peer(model, tip);
} catch (const std::exception& error) {
  std::cerr << urdf << ": " << error.what() << '\n';
  return nullptr;
}

// Solves `count` configurations, one after the other.
extern "C" void peer_solve(void* opened, const double* q, std::size_t count) {
  auto& peer = *static_cast<Peer*>(opened);
  const auto joints = static_cast<std::size_t>(peer.model.nq);
  for (std::size_t i = 0; i < count; ++i) {
    peer.solve(q + i * joints);
    asm volatile("" : : "r"(&peer) : "memory");  // every result counts as used
  }
}

// Solves one configuration: 3 of position, 9 of rotation row by row, 6 for each joint.
extern "C" void peer_result(void* opened, const double* q, double* out) {
  auto& peer = *static_cast<Peer*>(opened);
  peer.solve(q);
  const auto& placement = peer.data.oMf[peer.tip];
  Eigen::Map<Eigen::Vector3d>{out} = placement.translation();
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{out + 3} = placement.rotation();
  Eigen::Map<pinocchio::Data::Matrix6x>{out + 12, 6, peer.model.nv} = peer.jacobian;
}
