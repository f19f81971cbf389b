"""What all campaigns share: settings, plan, the folder that resumes, progress, results on disk."""
