"""What similar moments say beside a policy: simulated homes, questions, and fitted weights."""
