"""What happens before a real drone is armed: checks, parameters, fence, flight card, the operator's keys."""
