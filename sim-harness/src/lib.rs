//! A MuJoCo Panda, scenes, surrogate policies and episodes.
