//! Planner, grounder and critic.
