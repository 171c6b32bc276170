//! The router (Algorithm 1, lines 16 to 24): one route a query.

use crate::{gate::Authorisation, wire::Route};

/// Pending goes before target, target before execution, execution before base.
#[must_use]
pub const fn route(correction_pending: bool, gate: Authorisation) -> Route {
    match (correction_pending, gate) {
        (true, _) => Route::Pending,
        (false, Authorisation::Target(_)) => Route::Target,
        (false, Authorisation::Execution(_)) => Route::Execution,
        (false, Authorisation::Closed(_)) => Route::Base,
    }
}
