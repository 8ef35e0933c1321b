"""The abradable liner in time: plastic bars that a blade with unilateral contact wears away."""
